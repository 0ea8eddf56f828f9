#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "server/transport/library.h"

namespace creased {

/// Threads for the library, all of them there before the first connection. The library's own pool ends the program
/// when a thread cannot be started.
class ThreadPool final : public httplib::TaskQueue {
 public:
  /// \throw crease::Error process_unavailable when there are not so many threads to have
  explicit ThreadPool(std::size_t threads);
  ~ThreadPool() override { shutdown(); }
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  void enqueue(std::function<void()> task) override;
  /// Waits until all tasks are done and all threads have ended.
  void shutdown() override;

 private:
  void work();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool shut_down_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace creased
