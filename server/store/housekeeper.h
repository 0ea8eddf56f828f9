#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "server/store/store.h"

namespace creased {

/// Removes jobs whose time is over, from a thread of its own, as long as the object lives.
class Housekeeper {
 public:
  /// `on_removed` is told of every job that went.
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
