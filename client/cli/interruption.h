#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace crease::client {

/// Ctrl-C and SIGTERM while an object of this lives: the first asks the command to stop in order, the second ends the
/// process. Must be made before any thread that is not to take the signals itself.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  bool requested() const { return requested_; }
  /// Waits; true at once when interrupted.
  bool wait(std::chrono::milliseconds time);
  /// Called on another thread when the interruption comes, so that a blocking call can be ended; empty: nothing.
  void set_action(std::function<void()> action);
  /// \throw Failure interrupted, when requested
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
