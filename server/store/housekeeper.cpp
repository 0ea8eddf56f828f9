#include "server/store/housekeeper.h"

#include <spdlog/spdlog.h>

#include <utility>

#include "core/error.h"

namespace creased {

Housekeeper::Housekeeper(Store& store, std::chrono::milliseconds every,
                         std::function<void(const std::string& id)> on_removed)
    : store_(store),
      every_(every),
      on_removed_(std::move(on_removed)),
      thread_([this](const std::stop_token& ended) { keep(ended); }) {}

void Housekeeper::keep(const std::stop_token& ended) {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, ended, every_, [&ended] { return ended.stop_requested(); })) {
    try {
      for (const std::string& id : store_.remove_expired()) on_removed_(id);
    } catch (const crease::Error& error) {
      spdlog::warn("cannot remove expired jobs: {}", error.detail());
    }
  }
}

}  // namespace creased
