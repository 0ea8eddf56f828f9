#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "server/store/store.h"

namespace creased {

/// Removes expired jobs, and every hour what killed processes have left, from its own thread while it exists.
class Housekeeper {
 public:
  /// `on_removed` is called for every removed job.
  Housekeeper(Store& store, std::chrono::milliseconds every, std::function<void(const std::string& id)> on_removed);

 private:
  void keep(const std::stop_token& ended);

  Store& store_;
  std::chrono::milliseconds every_;
  std::function<void(const std::string&)> on_removed_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread thread_;
};

}  // namespace creased
