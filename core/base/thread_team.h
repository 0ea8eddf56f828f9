#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <limits>
#include <thread>
#include <vector>

namespace crease {

/// How many sites of a mesh are worth handing to a thread at once.
inline constexpr std::size_t kChunk = 4096;

/// Fewest sites of a mesh for each thread. With less, handing work over costs what it saves: from 3,000 faces on, two
/// threads sample faster than one.
inline constexpr std::size_t kSitesPerThread = 1500;

/// A few threads that run one loop after another with little delay between them: a sweep is a dozen short loops, one
/// for each phase.
class ThreadTeam {
 public:
  /// `threads` counts the calling thread; 0 means as many as the machine has. A mesh of few `sites` gets fewer.
  /// \throw std::system_error when the system has not as many
  explicit ThreadTeam(std::uint32_t threads, std::size_t sites = std::numeric_limits<std::size_t>::max());
  ~ThreadTeam();
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  std::size_t size() const { return helpers_.size() + 1; }

  /// Calls `body(begin, end, thread)` over [0, count) in chunks; returns when all are done. Every thread begins in a
  /// share of its own, the same from loop to loop, so that what it works on stays in its cache; whoever is done helps
  /// the others. `body` must not throw, and its effect must not depend on which thread takes which chunk.
  using Body = std::function<void(std::size_t begin, std::size_t end, std::size_t thread)>;
  void run(std::size_t count, std::size_t chunk, const Body& body);

 private:
  void stop();
  void help(std::size_t thread);
  void take_chunks(std::size_t thread);

  struct alignas(64) Share {
    std::atomic<std::size_t> next{0};
    std::size_t end = 0;
  };

  const Body* body_ = nullptr;
  std::size_t chunk_ = 1;
  std::vector<Share> shares_;  ///< one for each thread
  std::atomic<std::uint32_t> generation_{0};
  std::atomic<std::uint32_t> busy_{0};
  bool stopping_ = false;
  std::vector<std::jthread> helpers_;
};

/// A team of the calling thread alone, for those who have no other. It may be shared.
inline ThreadTeam& calling_thread() {
  static ThreadTeam alone(1);
  return alone;
}

/// Calls each of `tasks`, which do not depend on each other, at the same time if the team allows. Rethrows what the
/// first one that failed has thrown, after all have ended. A task must not use the team.
template <typename... Tasks>
void run_together(ThreadTeam& team, const Tasks&... tasks) {
  const std::array<std::function<void()>, sizeof...(Tasks)> calls{std::cref(tasks)...};
  std::array<std::exception_ptr, sizeof...(Tasks)> faults;
  team.run(calls.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t task = begin; task < end; ++task) {
      try {
        calls[task]();
      } catch (...) {
        faults[task] = std::current_exception();
      }
    }
  });
  for (const std::exception_ptr& fault : faults) {
    if (fault) std::rethrow_exception(fault);
  }
}

/// Calls `body(i)` for each i of [0, count), in any order.
template <typename Body>
void for_each(std::size_t count, ThreadTeam& team, Body body) {
  team.run(count, kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) body(i);
  });
}

/// Σ `term(i)` over [0, count), block by block, so that the order of additions does not depend on the threads.
template <typename Value, typename Term>
Value block_sum(std::size_t count, ThreadTeam& team, Term term) {
  constexpr std::size_t kBlock = 4096;
  std::vector<Value> sums((count + kBlock - 1) / kBlock, Value{});
  team.run(sums.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t block = begin; block < end; ++block) {
      Value sum{};
      for (std::size_t i = block * kBlock; i < std::min(count, (block + 1) * kBlock); ++i) sum += term(i);
      sums[block] = sum;
    }
  });
  Value total{};
  for (const Value& sum : sums) total += sum;
  return total;
}

}  // namespace crease
