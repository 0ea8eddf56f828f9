#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "client/cli/interruption.h"
#include "core/io/encode.h"
#include "crease/v1/job.pb.h"
#include "crease/v1/result.pb.h"

namespace crease::client {

/// A job that was run in this process, with everything that the service would report.
struct LocalJob {
  v1::Job job;
  v1::Report report;
  LabelledMesh result;
  std::string upload;  ///< the bytes of the mesh file
};

/// Checks and smooths a mesh as a worker of the service does. An empty `format` is guessed. `weights` names a file with
/// a JSON array, or is empty.
/// \throw Error mesh_*, weights_invalid, Failure file_unreadable, interrupted
LocalJob run_local_job(const std::filesystem::path& mesh, const std::string& format,
                       const std::filesystem::path& weights, const v1::Parameters& parameters,
                       const std::function<void(const v1::Progress&)>& on_progress, const Interruption& interruption);

}  // namespace crease::client
