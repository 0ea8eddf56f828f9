#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>

#include "core/io/decode.h"
#include "server/store/store.h"

namespace creased {

struct WorkerOptions {
  std::filesystem::path executable;  ///< creased itself, run as `creased compute`
  std::string name;                  ///< owner of the claims; unique to the process
  std::chrono::milliseconds lease{15'000};
  std::chrono::milliseconds poll{20};  ///< between looks for a job when there is none
  std::chrono::milliseconds progress_every{100};
  std::chrono::milliseconds snapshot_every{2'000};
  std::chrono::milliseconds checkpoint_every{10'000};
  std::uint64_t memory_bytes = 0;  ///< address space of the process that computes; 0: no limit
  std::uint64_t cpu_seconds = 0;   ///< processor time of an attempt; 0: no limit
  crease::DecodeLimits limits;
};

/// The name of a worker process of this host.
std::string worker_name(int process);

/// Whether `name` is that of a worker process of this host which is no more.
bool is_dead_worker(const std::string& name);

/// Claims jobs and runs them until `stop` is set; a job under way is then put back. Returns the exit code.
int run_worker(Store& store, const WorkerOptions& options, const std::atomic<bool>& stop);

}  // namespace creased
