#pragma once

#include <filesystem>
#include <string>

#include "crease/v1/parameters.pb.h"
#include "server/api/upload.h"

namespace creased {

/// The fields of a crease.v1.SubmitJobRequest other than its mesh and weights.
struct SubmitFields {
  std::string name;
  std::string format;
  crease::v1::Parameters parameters;
};

/// Reads a serialised SubmitJobRequest from a file. Copies its mesh into `mesh` in pieces, so that a large mesh is
/// never held in memory, and its weights, if any, into `weights`, as a JSON array like the one in a form. Validates the
/// parameters and the weights, but not the number of weights.
/// \throw crease::Error protobuf_invalid, parameter_invalid, parameter_out_of_range, weights_invalid
SubmitFields split_submit_message(const std::filesystem::path& message, UploadFile& mesh, UploadFile& weights);

}  // namespace creased
