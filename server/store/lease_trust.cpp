#include "server/store/lease_trust.h"

#include <cstdlib>
#include <ctime>

namespace creased {

std::int64_t clock_offset_ms() {
  using namespace std::chrono;
  timespec running{};
  ::clock_gettime(CLOCK_BOOTTIME, &running);  // goes on while the machine sleeps
  const auto wall = duration_cast<milliseconds>(system_clock::now().time_since_epoch());
  return (wall - duration_cast<milliseconds>(seconds(running.tv_sec) + nanoseconds(running.tv_nsec))).count();
}

std::int64_t ClockSteps::take() {
  constexpr std::int64_t kLeastMs = 60'000;
  const std::int64_t offset = clock_offset_ms(), step = offset - offset_.value_or(offset);
  offset_ = offset;
  return std::abs(step) < kLeastMs ? 0 : step;
}

bool LeaseTrust::trusted(std::chrono::milliseconds lease) {
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  if (clock_.take() != 0) distrusted_ = true;
  if (distrusted_) from_ = now + lease;
  distrusted_ = false;
  return now >= from_;
}

void LeaseTrust::distrust() {
  const std::lock_guard lock(mutex_);
  distrusted_ = true;
}

}  // namespace creased
