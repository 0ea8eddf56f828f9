#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace crease::client {

/// Handles Ctrl-C and SIGTERM while it exists. The first signal asks the command to stop cleanly, the second ends the
/// process. Create it before any other thread, so that those threads block the signals.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  bool requested() const { return requested_; }
  /// Waits for `time`. Returns true at once when interrupted.
  bool wait(std::chrono::milliseconds time);
  /// Sets a function that is called on another thread at the interruption, to end a blocking call. Empty for none.
  void set_action(std::function<void()> action);
  /// \throw Failure interrupted, after an interruption
  void check() const;

 private:
  void watch();

  std::atomic<bool> requested_{false}, closing_{false};
  std::mutex mutex_;
  std::condition_variable changed_;
  std::function<void()> action_;
  std::jthread watcher_;
};

}  // namespace crease::client
