#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "crease/v1/job.pb.h"

namespace creased {

/// What an inspection found. The caller adds name, bytes and sha256 to `facts`.
struct Inspection {
  crease::v1::InputFacts facts;
  std::vector<crease::v1::Warning> warnings;
};

/// Decodes and checks uploads in confined processes. So untrusted bytes are never parsed in the HTTP process, and a bad
/// upload is refused before it becomes a job. Checks a few uploads at a time; others wait.
class Inspector {
 public:
  struct Options {
    std::filesystem::path executable;  ///< the creased program, run as `creased compute`
    std::size_t processes = 2;
    std::size_t memory_limit_mb = 4096;  ///< address space of one check
    std::chrono::milliseconds timeout{60'000};
    std::size_t max_vertices = 20'000'000, max_faces = 20'000'000;
  };
  explicit Inspector(const Options& options);
  ~Inspector();

  /// Inspects an upload; waits for a free process first. An empty `format` is guessed from the extension of `name`,
  /// then from the bytes. `weights` names a file with a JSON array, or is empty.
  /// \throw crease::Error mesh_*, weights_invalid, or inspection_failed when the process crashed or exceeded a limit of
  /// time or memory on this upload
  Inspection inspect(const std::filesystem::path& upload, const std::string& format, const std::string& name,
                     const std::filesystem::path& weights = {});

  /// Waits for the first process. \throw crease::Error when it cannot be started
  void await_start();

  /// The ids of the running processes.
  std::vector<int> process_ids() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace creased
