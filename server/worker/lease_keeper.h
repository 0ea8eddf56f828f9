#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "server/store/store.h"

namespace creased {

/// Renews a lease from its own thread while it exists. Sets `cancel` when the job was taken away or should be
/// cancelled. Tries again when the store fails.
class LeaseKeeper {
 public:
  /// \throw Error process_unavailable when there is no thread to be had
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
