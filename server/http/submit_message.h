#pragma once

#include <filesystem>
#include <string>

#include "crease/v1/parameters.pb.h"
#include "server/http/upload.h"

namespace creased {

/// The fields of a crease.v1.SubmitJobRequest other than its mesh and weights.
struct SubmitFields {
  std::string name;
  std::string format;
  crease::v1::Parameters parameters;
};

/// Reads a serialised SubmitJobRequest from a file and copies its mesh into `mesh` piece by piece, so that a large
/// mesh is never held in memory; likewise its weights, if any, into `weights` as the JSON array that a form would
/// bring. Validates parameters and weights, but not how many there are of these. \throw crease::Error protobuf_invalid,
/// parameter_invalid, parameter_out_of_range, weights_invalid
SubmitFields split_submit_message(const std::filesystem::path& message, UploadFile& mesh, UploadFile& weights);

}  // namespace creased
