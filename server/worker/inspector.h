#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "crease/v1/job.pb.h"

namespace creased {

/// What an upload turned out to be. `facts` has neither name, bytes nor sha256: those are the receiver's.
struct Inspection {
  crease::v1::InputFacts facts;
  std::vector<crease::v1::Warning> warnings;
};

/// Decodes and checks uploads in confined processes, so that untrusted bytes are never parsed where HTTP is answered
/// and a bad upload is refused before it becomes a job. A few at a time; others wait.
class Inspector {
 public:
  struct Options {
    std::filesystem::path executable;  ///< creased itself, run as `creased compute`
    std::size_t processes = 2;
    std::size_t memory_limit_mb = 4096;  ///< address space of a check
    std::chrono::milliseconds timeout{60'000};
    std::size_t max_vertices = 20'000'000, max_faces = 20'000'000;
  };
  explicit Inspector(const Options& options);
  ~Inspector();

  /// Waits for a free child. `format` may be empty: then by `name`'s extension, then from the bytes. `weights`
  /// is a file with a JSON array of them, or empty.
  /// \throw crease::Error mesh_*, weights_invalid, or inspection_failed when the process died or ran out of time
  /// or memory on this upload
  Inspection inspect(const std::filesystem::path& upload, const std::string& format, const std::string& name,
                     const std::filesystem::path& weights = {});

  /// Of the children alive now.
  std::vector<int> process_ids() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace creased
