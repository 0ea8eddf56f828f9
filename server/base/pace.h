#pragma once

#include <algorithm>
#include <chrono>

namespace creased {

/// When to do again what is done again and again, so that it takes at most a share of the time.
class Pace {
 public:
  using Clock = std::chrono::steady_clock;

  /// One part in `parts` of the time at most, and no sooner than `least` after the last start.
  explicit Pace(int parts, Clock::duration least = {}) : parts_(parts), least_(least) {}

  bool due(Clock::time_point now = Clock::now()) const { return now >= next_; }
  /// Notes that it was done from `started` to `ended`.
  void note(Clock::time_point started, Clock::time_point ended = Clock::now()) {
    next_ = started + std::max(least_, parts_ * (ended - started));
  }

 private:
  int parts_;
  Clock::duration least_;
  Clock::time_point next_;
};

}  // namespace creased
