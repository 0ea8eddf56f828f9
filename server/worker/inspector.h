#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "crease/v1/job.pb.h"
#include "server/worker/task_pool.h"

namespace creased {

/// What an inspection found. The caller adds name, bytes and sha256 to `facts`.
struct Inspection {
  crease::v1::InputFacts facts;
  std::vector<crease::v1::Warning> warnings;
};

/// Decodes and checks uploads in confined processes. So untrusted bytes are never parsed in the HTTP process, and a bad
/// upload is refused before it becomes a job.
class Inspector {
 public:
  struct Options {
    std::size_t memory_limit_mb = 4096;  ///< address space of one check
    std::chrono::milliseconds timeout{60'000};
    std::size_t max_vertices = 20'000'000, max_faces = 20'000'000;
  };
  Inspector(TaskPool& pool, const Options& options) : pool_(pool), options_(options) {}

  /// What is to be inspected. An empty `format` is guessed from the extension of `name`, then from the bytes. `weights`
  /// names a file with a JSON array, or is empty.
  struct Upload {
    std::filesystem::path mesh;
    std::string format, name;
    std::filesystem::path weights = {};
    std::string owner = {};  ///< whose turn it is
  };

  /// Inspects an upload; waits for its turn first.
  /// \throw crease::Error mesh_*, weights_invalid, process_unavailable, or inspection_failed when the process crashed
  /// or exceeded a limit of time or memory on this upload
  Inspection inspect(const Upload& upload);

 private:
  TaskPool& pool_;
  const Options options_;
};

}  // namespace creased
