#include "core/base/thread_team.h"

#include <algorithm>

namespace crease {
namespace {

/// Loops follow each other within microseconds, so it pays to look a few thousand times before going to sleep.
constexpr int kSpins = 4000;

void pause_briefly() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#endif
}

/// Waits until `value` is no longer `old`.
std::uint32_t wait_for_change(const std::atomic<std::uint32_t>& value, std::uint32_t old) {
  for (int spin = 0; spin < kSpins; ++spin) {
    const std::uint32_t now = value.load(std::memory_order_acquire);
    if (now != old) return now;
    pause_briefly();
  }
  value.wait(old, std::memory_order_acquire);
  return value.load(std::memory_order_acquire);
}

}  // namespace

ThreadTeam::ThreadTeam(std::uint32_t threads, std::size_t sites) {
  const std::size_t allowed = threads != 0 ? threads : std::max(1U, std::thread::hardware_concurrency());
  const std::size_t wanted = std::min(allowed, std::max<std::size_t>(1, sites / kSitesPerThread));
  shares_ = std::vector<Share>(wanted);
  try {
    for (std::size_t thread = 1; thread < wanted; ++thread) {
      helpers_.emplace_back([this, thread] { help(thread); });
    }
  } catch (...) {
    stop();  // or those that have started would be waited for for ever
    throw;
  }
}

ThreadTeam::~ThreadTeam() { stop(); }

void ThreadTeam::stop() {
  stopping_ = true;
  generation_.fetch_add(1, std::memory_order_release);
  generation_.notify_all();
}

void ThreadTeam::run(std::size_t count, std::size_t chunk, const Body& body) {
  if (helpers_.empty() || count <= chunk) {
    if (count > 0) body(0, count, 0);
    return;
  }
  body_ = &body;
  chunk_ = chunk;
  for (std::size_t thread = 0; thread < shares_.size(); ++thread) {
    shares_[thread].next.store(count * thread / shares_.size(), std::memory_order_relaxed);
    shares_[thread].end = count * (thread + 1) / shares_.size();
  }
  busy_.store(static_cast<std::uint32_t>(helpers_.size()), std::memory_order_relaxed);
  generation_.fetch_add(1, std::memory_order_release);
  generation_.notify_all();
  take_chunks(0);
  for (std::uint32_t busy = busy_.load(std::memory_order_acquire); busy != 0;) busy = wait_for_change(busy_, busy);
}

void ThreadTeam::help(std::size_t thread) {
  std::uint32_t seen = 0;
  for (;;) {
    wait_for_change(generation_, seen);
    // A run ends only when every helper has answered, so no generation can be missed.
    ++seen;
    if (stopping_) return;
    take_chunks(thread);
    if (busy_.fetch_sub(1, std::memory_order_acq_rel) == 1) busy_.notify_one();
  }
}

void ThreadTeam::take_chunks(std::size_t thread) {
  for (std::size_t turn = 0; turn < shares_.size(); ++turn) {
    Share& share = shares_[(thread + turn) % shares_.size()];
    for (;;) {
      const std::size_t begin = share.next.fetch_add(chunk_, std::memory_order_relaxed);
      if (begin >= share.end) break;
      (*body_)(begin, std::min(begin + chunk_, share.end), thread);
    }
  }
}

}  // namespace crease
