#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "server/store/store.h"

namespace creased {

/// Renews a lease from a thread of its own as long as the object lives. When the job was taken away or is to be
/// cancelled, `cancel` is set; a store that does not answer is asked again.
class LeaseKeeper {
 public:
  LeaseKeeper(Store& store, const Claim& claim, std::chrono::milliseconds lease, std::atomic<bool>& cancel);

 private:
  void keep(const std::stop_token& ended);

  Store& store_;
  const Claim& claim_;
  std::chrono::milliseconds lease_;
  std::atomic<bool>& cancel_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread thread_;
};

}  // namespace creased
