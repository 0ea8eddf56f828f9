#pragma once

#include <chrono>
#include <cstdint>

#include "crease/v1/job.pb.h"

namespace creased {

/// What a job will need at most, estimated from the size of its mesh and its sweeps. The limits of its process, the
/// quotas, the admission and the order of the queue all use this estimate.
struct Needs {
  std::uint64_t file_bytes = 0;  ///< its largest file
  std::uint64_t disk_bytes =
      0;  ///< all its files but the upload and the weights, each twice while one replaces another
  std::chrono::milliseconds work{0};  ///< time on one processor; only comparable, not exact
};

Needs needs_of(const crease::v1::InputFacts& input, std::uint32_t sweeps);

}  // namespace creased
