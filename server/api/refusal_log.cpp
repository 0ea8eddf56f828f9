#include "server/api/refusal_log.h"

namespace creased {

bool RefusalLog::admit(const std::string& reason, Clock::time_point now) {
  constexpr std::chrono::seconds kSecond{1};
  const std::lock_guard lock(mutex_);
  Count& count = by_reason_[reason];
  if (now - count.second >= kSecond) {
    count.second = now;
    count.logged = 0;
  }
  if (++count.logged <= kOneByOne) return true;
  if (count.left_out++ == 0) count.since = now;
  return false;
}

std::vector<RefusalLog::Summary> RefusalLog::take_summaries(Clock::duration every, Clock::time_point now) {
  std::vector<Summary> summaries;
  const std::lock_guard lock(mutex_);
  if (now - last_summary_ < every) return summaries;
  last_summary_ = now;
  for (auto& [reason, count] : by_reason_) {
    if (count.left_out == 0) continue;
    summaries.push_back({reason, count.left_out, std::chrono::duration<double>(now - count.since).count()});
    count.left_out = 0;
  }
  return summaries;
}

}  // namespace creased
