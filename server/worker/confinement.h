#pragma once

#include <linux/filter.h>

#include <vector>

#include "crease/v1/compute.pb.h"

namespace creased {

/// What untrusted bytes are parsed and computed under. Off in builds with a sanitizer, whose own threads and files it
/// would forbid.
class Confinement {
 public:
  /// Makes the filter of system calls: memory, threads and the descriptors at hand, but no file is opened, no program
  /// run, no process started or looked at, nothing connected. \throw crease::Error internal
  Confinement();

  /// Confines this process for good: limits, no new privileges, no core dump, the filter. Must be its only thread.
  /// \throw crease::Error internal
  void enter(const crease::v1::ComputeLimits& limits) const;

 private:
  std::vector<sock_filter> program_;
};

}  // namespace creased
