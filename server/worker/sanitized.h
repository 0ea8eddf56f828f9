#pragma once

namespace creased {

/// Whether AddressSanitizer or ThreadSanitizer is built in: they reserve more address space than any limit, and open
/// files and start threads that a filter would forbid.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)
inline constexpr bool kSanitized = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace creased
