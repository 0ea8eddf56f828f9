#include "server/worker/worker.h"

#include <malloc.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <thread>

#include "core/error.h"
#include "server/worker/job_run.h"

namespace creased {
namespace {

constexpr std::chrono::milliseconds kLongestPause{2'000};

/// True: there was a job.
bool run_next(Store& store, const WorkerOptions& options, const std::atomic<bool>& stop) {
  auto claim = store.claim(options.name, options.lease);
  if (!claim) return false;
  JobRun(store, options, std::move(*claim), stop).run();
  ::malloc_trim(0);
  return true;
}

}  // namespace

int run_worker(Store& store, const WorkerOptions& options, const std::atomic<bool>& stop) {
  auto pause = options.poll;
  while (!stop) {
    try {
      if (run_next(store, options, stop)) continue;
      pause = options.poll;
    } catch (const crease::Error& error) {
      spdlog::error("worker {}: {}", options.name, error.detail());
      pause = std::min(pause * 2, kLongestPause);
    }
    std::this_thread::sleep_for(pause);
  }
  return 0;
}

}  // namespace creased
