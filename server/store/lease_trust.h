#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>

namespace creased {

/// How much the wall clock differs from what it would show if nobody had set it, in milliseconds.
std::int64_t clock_offset_ms();

/// Notices when the wall clock was set by more than a minute.
class ClockSteps {
 public:
  /// The step since the last call, in milliseconds; 0 for none.
  std::int64_t take();

 private:
  std::optional<std::int64_t> offset_;
};

/// Whether an expired lease means that its worker has gone. It does not while the store cannot write, as then nobody
/// can renew a lease, nor after the clock was set, until every worker has had the time of a lease to renew its own.
class LeaseTrust {
 public:
  bool trusted(std::chrono::milliseconds lease);
  void distrust();

 private:
  std::mutex mutex_;
  ClockSteps clock_;
  bool distrusted_ = false;
  std::chrono::steady_clock::time_point from_;
};

}  // namespace creased
