#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/formats.h"
#include "core/job.h"
#include "crease/v1/compute.pb.h"
#include "crease/v1/job.pb.h"
#include "crease/v1/result.pb.h"

namespace crease {

/// A job is put together in the same steps wherever it runs, in the confined processes of the service, with
/// `crease smooth --local`, and in tests: check_upload → settled → run_job (core/job.h) → make_report → encode.

/// What was uploaded.
struct Upload {
  std::string_view bytes;
  std::string format;  ///< empty to guess it from the extension of `name`, then from the bytes
  std::string name;    ///< of the file, without folders
  std::optional<std::string_view> weights = std::nullopt;  ///< a JSON array
  DecodeLimits limits = {};
  std::uint32_t threads = 1;  ///< to check with; as in SmoothOptions
};

/// Decodes and checks an upload. \throw Error mesh_*, weights_invalid
CheckedInput check_upload(const Upload& upload);

/// Completes what a check has found with what it can not know.
void describe_upload(v1::InputFacts& facts, const std::string& name, std::uint64_t bytes, const std::string& sha256);

/// A job with its input, its parameters with all defaults, the warnings about both, and its fingerprint as the id.
/// \throw Error parameter_*
v1::Job settled(const v1::InputFacts& input, const v1::Parameters& asked, const std::vector<v1::Warning>& of_input);

/// The report of a job that succeeded.
v1::Report make_report(const v1::Job& job, const JobOutput& output, const v1::Timings& timings);

/// Extras of the mesh files of a job.
nlohmann::ordered_json extras_of(const v1::Job& job);

/// One part of a result, as a file. `format` is one of those in result_formats.h, `min_label` is for labels.
std::string encode(v1::ResultPart part, const Format& format, const LabelledMesh& result, const v1::Job& job,
                   double min_label = 0, const MeshStyle& style = {});
std::string encode(const Format& format, const v1::Report& report);

/// Whether a mesh in `format` takes anything over from the upload.
bool takes_over(const v1::InputFacts& input, const Format& format);

/// What the upload of a job has beside the shape of its surface. \throw Error upload_damaged
Appearance appearance_of(const v1::InputFacts& input, std::string_view upload);

/// The upload of a job with the positions of its result. \throw Error upload_damaged, and as encode_original
std::string original(const v1::InputFacts& input, std::string_view upload, const LabelledMesh& result);

/// The part of a result that `task` names, made from the file `stored` of the job, and where the task has it, from the
/// `upload`.
/// \throw Error result_damaged when it cannot be read, not_found when it was stored without the measured positions,
/// upload_damaged, and as encode_original
std::string encode_stored(const v1::EncodeTask& task, std::string_view stored, std::string_view upload = {});

}  // namespace crease
