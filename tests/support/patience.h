#pragma once

#include <chrono>
#include <functional>

namespace crease::test {

/// How long a test waits for an event that must happen. A wait ends with its event, so only a failing test takes this
/// long, and a busy machine fails no test.
inline constexpr std::chrono::seconds kPatience{300};

/// Polls until the condition holds. Returns false when it does not within the time.
bool eventually(const std::function<bool()>& condition, std::chrono::milliseconds time = kPatience);

}  // namespace crease::test
