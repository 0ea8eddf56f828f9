#pragma once

#include <chrono>
#include <cstdint>

#include "crease/v1/job.pb.h"

namespace creased {

/// What a job will need at most, estimated from the size of its mesh, its solver, sweeps and threads. The limits of its
/// process, the quotas, the admission and the order of the queue all use this estimate.
struct Needs {
  std::uint64_t memory_bytes = 0;   ///< address space of its process, and of each that makes a file of its result
  std::uint64_t file_bytes = 0;     ///< the largest file of its process
  std::uint64_t encoded_bytes = 0;  ///< the largest file that is made of its result
  /// All its files but the upload and the weights: the result, a checkpoint and the one that replaces it, and a
  /// downloaded mesh.
  std::uint64_t disk_bytes = 0;
  std::chrono::milliseconds work{0};  ///< time on one processor; only comparable, not exact
};

/// About how long it takes to check an upload, or to encode a stored result, of so many bytes; only comparable.
std::chrono::milliseconds reading_time(std::uint64_t bytes);

/// `parameters` are all of the job's, resolved; `threads` in them counts as 1 when it is 0.
Needs needs_of(const crease::v1::InputFacts& input, const crease::v1::Parameters& parameters);

}  // namespace creased
