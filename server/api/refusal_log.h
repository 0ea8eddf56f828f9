#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace creased {

/// Keeps a flood of refusals from filling the log: of each reason the first few in a second are logged one by one, and
/// the others are counted.
class RefusalLog {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::uint64_t kOneByOne = 10;  ///< of a reason in a second

  struct Summary {
    std::string reason;
    std::uint64_t count = 0;  ///< that were not logged one by one
    double seconds = 0;       ///< in which they came
  };

  /// Whether a refusal for this reason is to be logged by itself. `reason` is one of a bounded number of words.
  bool admit(const std::string& reason, Clock::time_point now = Clock::now());
  /// What has not been logged one by one since the last call, one line for a reason, at most once in `every`.
  std::vector<Summary> take_summaries(Clock::duration every, Clock::time_point now = Clock::now());

 private:
  struct Count {
    Clock::time_point second;    // start of the second in which refusals are logged one by one
    std::uint64_t logged = 0;    // in that second
    std::uint64_t left_out = 0;  // since the last summary
    Clock::time_point since;     // of the first that was left out
  };

  std::mutex mutex_;
  std::map<std::string, Count> by_reason_;
  Clock::time_point last_summary_;
};

}  // namespace creased
