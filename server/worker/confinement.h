#pragma once

#include <linux/filter.h>

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

  /// Confines this process for the rest of its life: limits, no new privileges, no core dump, and the filter. Must be
  /// called while the process has one thread.
  /// \throw crease::Error internal
  void enter(const crease::v1::ComputeLimits& limits) const;

 private:
  std::vector<sock_filter> program_;
};

}  // namespace creased
