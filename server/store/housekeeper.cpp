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
  constexpr std::chrono::hours kCleaning{1};
  auto next_cleaning = std::chrono::steady_clock::now() + kCleaning;
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, ended, every_, [&ended] { return ended.stop_requested(); })) {
    try {
      for (const std::string& id : store_.remove_expired()) on_removed_(id);
      if (const auto now = std::chrono::steady_clock::now(); now >= next_cleaning) {
        next_cleaning = now + kCleaning;
        store_.clean_leftovers();
      }
    } catch (const crease::Error& error) {
      spdlog::warn("cannot remove expired jobs: {}", error.detail());
    }
  }
}

}  // namespace creased
