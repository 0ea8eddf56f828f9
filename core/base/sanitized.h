#pragma once

namespace crease {

/// Whether this is a build with AddressSanitizer or ThreadSanitizer. They reserve more address space than any limit
/// allows, and they open files and start threads, which the filter of confined processes forbids.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)
inline constexpr bool kSanitized = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace crease
