#include "server/store/health.h"

#include <spdlog/spdlog.h>

#include "core/error.h"

namespace creased {
namespace {

constexpr std::chrono::seconds kEvery{1};
constexpr std::chrono::seconds kLongestLook{20};  // a disk that takes longer is as good as none
constexpr std::chrono::seconds kPulseCounts{10}, kStartTime{15};

}  // namespace

Health::Health(Store& store, bool workers)
    : store_(store), workers_(workers), reason_(look()), looked_(Clock::now()), thread_([this](const auto& ended) {
        keep(ended);
      }) {}

std::string Health::reason() const {
  const std::lock_guard lock(mutex_);
  if (Clock::now() - looked_ > kLongestLook) return "the disk has not answered for a while";
  return reason_;
}

void Health::keep(const std::stop_token& ended) {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, ended, kEvery, [&ended] { return ended.stop_requested(); })) {
    lock.unlock();
    std::string reason = look();
    lock.lock();
    if (reason != reason_) spdlog::warn("{}", reason.empty() ? "ready again" : "not ready: " + reason);
    reason_ = std::move(reason);
    looked_ = Clock::now();
  }
}

std::string Health::look() const {
  try {
    if (std::string reason = store_.not_ready_reason(); !reason.empty()) return reason;
    return workers_ ? fault_of_workers() : std::string();
  } catch (const crease::Error& error) {
    return error.detail();
  }
}

std::string Health::fault_of_workers() const {
  std::string problem;
  for (const WorkerHealth& worker : store_.workers()) {
    if (worker.age > kPulseCounts) continue;
    if (worker.problem.empty()) return {};
    problem = "no worker can run jobs: " + worker.problem;
  }
  if (problem.empty() && Clock::now() - started_ > kStartTime) return "no worker answers";
  return problem;
}

}  // namespace creased
