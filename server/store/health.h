#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "server/store/store.h"

namespace creased {

/// Whether the service can take and run jobs, found out once a second from its own thread, so that asking costs
/// nothing.
class Health {
 public:
  /// With `workers`, one of the workers must be able to run jobs.
  Health(Store& store, bool workers);

  /// Why the service cannot take or run jobs; empty when it can.
  std::string reason() const;

 private:
  using Clock = std::chrono::steady_clock;
  void keep(const std::stop_token& ended);
  std::string look() const;
  std::string fault_of_workers() const;

  Store& store_;
  const bool workers_;
  const Clock::time_point started_ = Clock::now();
  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  std::string reason_;
  Clock::time_point looked_;
  std::jthread thread_;
};

}  // namespace creased
