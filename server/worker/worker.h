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
  std::filesystem::path executable;  ///< the creased program, run as `creased compute`
  std::string name;                  ///< owner of the claims; unique to this process
  std::chrono::milliseconds lease{15'000};
  std::chrono::milliseconds poll{20};  ///< pause between looks for a job
  std::chrono::milliseconds progress_every{100};
  std::chrono::milliseconds snapshot_every{2'000};
  std::chrono::milliseconds checkpoint_every{10'000};
  std::uint64_t memory_bytes = 0;  ///< address space of the computing process; 0 for no limit
  std::uint64_t cpu_seconds = 0;   ///< processor time of an attempt; 0 for no limit
  crease::DecodeLimits limits;
};

/// The name of a worker process on this host. With `shared`, no other host or container has a worker of that name, even
/// when it is called the same.
std::string worker_name(int process, bool shared = false);

/// Whether `name` belongs to a worker process on this host that has ended.
bool is_dead_worker(const std::string& name, bool shared = false);

/// Claims jobs and runs them until `stop` is set, then returns its current job to the queue. Returns the exit code.
int run_worker(Store& store, const WorkerOptions& options, const std::atomic<bool>& stop);

}  // namespace creased
