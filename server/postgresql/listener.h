#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "server/base/durable_file.h"

namespace creased {

/// What the database tells those who listen.
enum class Channel {
  kChanges,  ///< a job has changed; with the version of the change
  kQueue,    ///< a job may be claimed
  kHolds,    ///< a running job was cancelled, removed or taken from its worker
};
inline constexpr std::array kChannelNames = {"creased_changes", "creased_queue", "creased_holds"};
constexpr const char* name_of(Channel channel) { return kChannelNames.at(static_cast<std::size_t>(channel)); }

/// Listens on a connection of its own, from a thread of its own, so that nobody has to ask the database whether
/// something has happened. What was told while the connection was lost counts as one more signal when it is back.
class Listener {
 public:
  explicit Listener(std::string url);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  /// How many signals came on a channel; the first call begins to listen. 0 while nothing can be heard, so that callers
  /// have to ask the database: a signal is never missed, only late.
  std::uint64_t signals(Channel channel);
  /// The last version of the changes; 0 while it is not known.
  std::uint64_t last_version();
  /// Notes a version that this process has committed itself, before it is told.
  void note_version(std::uint64_t version);

 private:
  class Ear;

  void run(const std::stop_token& ended);
  void listen(const std::stop_token& ended);
  void hear(Channel channel, const std::string& payload);
  void set_deaf();
  bool want(Channel channel);

  const std::string url_;
  std::array<std::atomic<bool>, kChannelNames.size()> wanted_{};
  std::array<std::atomic<bool>, kChannelNames.size()> heard_{};
  std::array<std::atomic<std::uint64_t>, kChannelNames.size()> signals_{};
  std::atomic<std::uint64_t> version_{0};
  std::mutex mutex_;
  std::condition_variable_any changed_;
  Descriptor wake_;  // an event for the thread: a channel is wanted, or it should end
  std::jthread thread_;
};

}  // namespace creased
