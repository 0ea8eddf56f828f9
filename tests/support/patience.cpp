#include "tests/support/patience.h"

#include <poll.h>

namespace crease::test {

bool eventually(const std::function<bool()>& condition, std::chrono::milliseconds time) {
  constexpr int kLookEveryMs = 5;
  const auto deadline = std::chrono::steady_clock::now() + time;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    ::poll(nullptr, 0, kLookEveryMs);
  }
  return true;
}

}  // namespace crease::test
