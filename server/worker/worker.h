#pragma once

#include <atomic>
#include <chrono>
#include <string>

#include "core/io/decode.h"
#include "server/store/store.h"

namespace creased {

struct WorkerOptions {
  std::string name;  ///< owner of the claims; unique to the process
  std::chrono::milliseconds lease{15'000};
  std::chrono::milliseconds poll{20};  ///< between looks for a job when there is none
  std::chrono::milliseconds progress_every{100};
  std::chrono::milliseconds snapshot_every{2'000};
  crease::DecodeLimits limits;
};

/// Claims jobs and runs them until `stop` is set; a job under way is then put back. Returns the exit code.
int run_worker(Store& store, const WorkerOptions& options, const std::atomic<bool>& stop);

}  // namespace creased
