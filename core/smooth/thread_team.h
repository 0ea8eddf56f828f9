#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

namespace crease {

/// A few threads that run one loop after another with little delay between them: a sweep is a dozen short loops, one
/// for each colour.
class ThreadTeam {
 public:
  /// `threads` counts the calling thread; 0 means as many as the machine has.
  explicit ThreadTeam(std::uint32_t threads);
  ~ThreadTeam();
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  std::size_t size() const { return helpers_.size() + 1; }

  /// Calls `body(begin, end, thread)` over [0, count) in chunks; returns when all are done. `body` must not throw, and
  /// its effect must not depend on which thread takes which chunk.
  using Body = std::function<void(std::size_t begin, std::size_t end, std::size_t thread)>;
  void run(std::size_t count, std::size_t chunk, const Body& body);

 private:
  void help(std::size_t thread);
  void take_chunks(std::size_t thread);

  const Body* body_ = nullptr;
  std::size_t count_ = 0, chunk_ = 1;
  std::atomic<std::size_t> next_{0};
  std::atomic<std::uint32_t> generation_{0};
  std::atomic<std::uint32_t> busy_{0};
  bool stopping_ = false;
  std::vector<std::jthread> helpers_;
};

}  // namespace crease
