#pragma once

#include <linux/filter.h>

#include <chrono>
#include <cstdint>
#include <vector>

#include "crease/v1/compute.pb.h"

namespace creased {

/// The confinement of processes that parse and compute untrusted input. It is off in builds with a sanitizer, because
/// it would forbid the sanitizer's own threads and files.
class Confinement {
 public:
  /// Compiles the filter of system calls. It allows memory, threads, and open descriptors; it forbids opening files,
  /// running programs, starting or inspecting processes, and network connections.
  /// \throw crease::Error internal
  Confinement();

  /// Confines this process for the rest of its life: another user than root, limits, no new privileges, no core dump,
  /// no files by Landlock where the kernel has it, and the filter. Must be called while the process has one thread.
  /// \throw crease::Error internal
  void enter(const crease::v1::ComputeLimits& limits) const;

 private:
  std::vector<sock_filter> program_;
};

/// How many threads the user of the tasks may have in all: those that it has, and some for a task. Counts them again
/// when the last count is old.
class ThreadBudget {
 public:
  /// 0 in a container, where the threads of other containers would count without being seen: its own limit has to do.
  std::uint64_t now();

 private:
  std::chrono::steady_clock::time_point counted_;
  std::uint64_t limit_ = 0;
};

}  // namespace creased
