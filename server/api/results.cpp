#include "server/api/results.h"

#include <fmt/format.h>

#include <vector>

#include "proto/convert.h"
#include "proto/result_formats.h"
#include "server/api/file_name.h"
#include "server/api/jobs.h"
#include "server/transport/accept.h"
#include "server/transport/file_download.h"

namespace creased {
namespace code = crease::code;
namespace v1 = crease::v1;
namespace {

using crease::Error;
using crease::Format;
using Json = nlohmann::ordered_json;

/// The format that the query names, otherwise the first one.
const Format& named_format(Call& call, const crease::Formats& offered) {
  const std::string name = call.query("format", std::string(offered.front()->name));
  return *crease::find_by_name(offered, name);
}

/// The format that the query names, or else the one in `offered`, best first, that the Accept header prefers.
const Format& wanted_format(Call& call, const crease::Formats& offered) {
  if (!call.query("format").empty()) return named_format(call, offered);
  call.response.set_header("Vary", "Accept");
  std::vector<std::string_view> types;
  for (const Format* format : offered) types.push_back(format->media_types.front());
  const auto chosen = negotiate(call.exchange.head.header("Accept"), types);
  if (!chosen) throw Error(code::kNotAcceptable, fmt::format("available media types: {}", fmt::join(types, ", ")));
  return *offered[*chosen];
}

/// The format of the upload, for those who ask for the original.
const Format& uploaded_format(const crease::v1::Job& job) {
  return crease::format_row(crease::format_from_name(job.input().format()).value());
}

std::vector<std::string> mesh_format_names() {
  std::vector<std::string> offered = format_names(crease::mesh_formats());
  offered.emplace_back(crease::kOriginal);
  return offered;
}

/// Whether the query has a field. \throw Error parameter_invalid for a format without it
bool wants(const Call& call, const std::string& field, bool Format::*has, const Format& format, bool original) {
  const std::string value = call.query(field);
  if (value.empty() || value == "false") return false;
  if (format.*has && !original) return true;
  throw Error::parameter(
      code::kParameterInvalid, field, value,
      fmt::format("no such field with this format; {} has it", crease::name_list(crease::formats_that(has))));
}

crease::MeshStyle wanted_style(const Call& call, const Format& format, bool original) {
  return {wants(call, "ridges", &Format::has_ridge_lines, format, original),
          wants(call, "compress", &Format::has_compression, format, original),
          wants(call, "quantized", &Format::has_compression, format, original)};
}

void require_success(const crease::v1::Job& job) {
  if (job.state() == "succeeded") return;
  if (job.state() == "cancelled") throw Error(code::kJobCancelled, "the job was cancelled and has no result");
  if (job.state() == "failed") throw Error(code::kJobFailed, job.error().code() + ": " + job.error().detail());
  throw Error(code::kJobNotFinished, "the job is " + job.state());
}

std::string etag(const crease::v1::Job& job, const std::string& what) {
  return fmt::format("{}-{}-{}", crease::job_fingerprint(job.input(), job.parameters()), CREASE_VERSION, what);
}

TaskPool::Asker asker(Call& call) {
  return {call.owner(), [&stream = call.exchange.stream] { return stream.peer_gone(); }};
}

std::string disposition(const crease::v1::Job& job, std::string_view part, const Format& format) {
  return attachment(job.input().name(), job.id(), part, format.extensions.front());
}

void get_mesh(Services& services, Call& call) {
  const auto job = find_job(services.store, call);
  const bool original = call.query("format") == crease::kOriginal;
  const Format& format = original ? uploaded_format(job) : wanted_format(call, crease::mesh_formats());
  const bool snapshot = call.query_flag("snapshot") && !is_terminal(job.state());
  if (!snapshot) require_success(job);
  const bool measured = call.query_flag("measured");
  if (measured && snapshot) {
    throw Error::parameter(code::kParameterInvalid, "measured", "true", "false, or left out, with snapshot=true");
  }
  const crease::MeshStyle style = wanted_style(call, format, original);
  const v1::ResultPart part = snapshot   ? v1::RESULT_PART_SNAPSHOT
                              : measured ? v1::RESULT_PART_MEASURED
                                         : v1::RESULT_PART_MESH;
  const std::string variant =
      fmt::format("{}{}", measured ? "measured" : "mesh", original ? "-original" : style_suffix(style));
  send_file(call.exchange, call.response,
            {.file = services.results.file(job, {part, format, 0, original, style}, asker(call)),
             .media_type = std::string(format.media_types.front()),
             .etag = snapshot ? "" : etag(job, variant + "." + std::string(format.extensions.front())),
             .disposition = disposition(job, measured ? "measured" : "smooth", format)});
}

void get_labels(Services& services, Call& call) {
  const auto job = find_job(services.store, call);
  require_success(job);
  const Format& format = named_format(call, crease::label_formats());
  const double min = call.query_number("min", 0);
  send_file(call.exchange, call.response,
            {.file = services.results.file(job, {v1::RESULT_PART_LABELS, format, min}, asker(call)),
             .media_type = std::string(format.media_types.front()),
             .etag = etag(job, fmt::format("labels-{}-{}", min, format.name)),
             .disposition = disposition(job, "labels", format)});
}

void get_ridges(Services& services, Call& call) {
  const auto job = find_job(services.store, call);
  const Format& format = wanted_format(call, crease::ridge_formats());
  require_success(job);
  send_file(call.exchange, call.response,
            {.file = services.results.file(job, {v1::RESULT_PART_RIDGES, format}, asker(call)),
             .media_type = std::string(format.media_types.front()),
             .etag = etag(job, fmt::format("ridges-{}", format.name)),
             .disposition = disposition(job, "ridges", format)});
}

void get_report(Services& services, Call& call) {
  const auto job = find_job(services.store, call);
  require_success(job);
  const Format& format = named_format(call, crease::report_formats());
  send_file(call.exchange, call.response,
            {.file = services.results.file(job, {v1::RESULT_PART_REPORT, format}, asker(call)),
             .media_type = std::string(format.media_types.front()),
             .etag = "",  // another run of the same job has other timings
             .disposition = disposition(job, "report", format)});
}

}  // namespace

Json labels_schema() {
  const Json numbers = {{"type", "array"}, {"items", {{"type", "number"}}}};
  const Json pair = {{"type", "array"}, {"items", {{"type", "integer"}}}, {"minItems", 2}, {"maxItems", 2}};
  return {{"type", "object"},
          {"required", {"edges", "labels", "dihedral_deg", "count", "threshold"}},
          {"properties",
           {{"edges", {{"type", "array"}, {"items", pair}}},
            {"labels", numbers},
            {"dihedral_deg", numbers},
            {"count", {{"type", "integer"}}},
            {"threshold", {{"type", "number"}}}}}};
}

Json ridge_lines_schema() {
  const Json indices = {{"type", "array"}, {"items", {{"type", "integer"}, {"minimum", 0}}}};
  const Json number = {{"type", "number"}};
  const Json line = {{"type", "object"},
                     {"required", {"vertices", "closed", "length", "mean_label", "mean_dihedral_deg"}},
                     {"properties",
                      {{"vertices", indices},
                       {"closed", {{"type", "boolean"}}},
                       {"length", number},
                       {"mean_label", number},
                       {"mean_dihedral_deg", number}}}};
  return {{"type", "object"},
          {"required", {"ridges", "count", "corners"}},
          {"properties",
           {{"ridges", {{"type", "array"}, {"items", line}}}, {"count", {{"type", "integer"}}}, {"corners", indices}}}};
}

std::vector<Route> result_routes() {
  const std::vector<crease::ErrorCode> unfinished = {
      code::kJobNotFound,  code::kResultDamaged,    code::kJobNotFinished, code::kJobFailed,
      code::kJobCancelled, code::kParameterInvalid, code::kEncodingFailed, code::kProcessUnavailable};
  auto with = [&](std::vector<crease::ErrorCode> more) {
    more.insert(more.begin(), unfinished.begin(), unfinished.end());
    return more;
  };
  return {
      {"GET",
       "/v1/jobs/{id}/mesh",
       "get_mesh",
       "Download the smoothed mesh",
       {{"format", "string",
         "Format of the mesh; the path may end in it instead: mesh.glb. By default the Accept header decides, or "
         "else it is glb. 'original' is the uploaded file, in its own format, with nothing but its positions and "
         "normals replaced. The other formats have the positions and faces, what the job has found, and of the "
         "upload's colours, texture coordinates and materials what the format has a place for; the warning "
         "attributes_dropped says what gets lost in which formats.",
         mesh_format_names()},
        {"ridges", "string", "With format=obj: 'lines' adds the ridges as line elements.", {"lines"}},
        {"compress",
         "string",
         "With format=glb or gltf: 'meshopt' compresses the buffer by EXT_meshopt_compression, without loss.",
         {"meshopt"}},
        {"quantized", "boolean",
         "With format=glb or gltf: positions as whole numbers up to 65535 over the longest side of the mesh, so that a "
         "coordinate is off by at most 1/131070 of it, normals in 8 bits, colours in 16 (KHR_mesh_quantization)."},
        {"snapshot", "boolean", "While the job is running, its latest intermediate mesh."},
        {"measured", "boolean",
         "The measured positions in place of the smoothed ones, with the same vertices, faces and splits as the "
         "result."}},
       {{200, "The mesh.", media_types(crease::mesh_formats()), "LabelledMesh"},
        {206, "A range of its bytes.", media_types(crease::mesh_formats()), "LabelledMesh"},
        {304, "The mesh in If-None-Match is current.", {}, ""}},
       with({code::kNotAcceptable, code::kRangeNotSatisfiable, code::kSnapshotUnavailable, code::kMeshUnsupported,
             code::kUploadDamaged}),
       get_mesh},
      {"GET",
       "/v1/jobs/{id}/labels",
       "get_labels",
       "Download the ridge label and the signed dihedral angle of every edge",
       {{"format", "string", "Format of the labels; the path may end in it instead: labels.csv.",
         format_names(crease::label_formats())},
        {"min", "number", "Only edges with a label of at least this.", {}, 0, 1}},
       {{200, "The labels.", media_types(crease::label_formats()), "EdgeLabels"},
        {206, "A range of their bytes.", media_types(crease::label_formats()), ""},
        {304, "The labels in If-None-Match are current.", {}, ""}},
       with({code::kRangeNotSatisfiable, code::kParameterOutOfRange}),
       get_labels},
      {"GET",
       "/v1/jobs/{id}/ridges",
       "get_ridges",
       "Download the ridge lines and the corners where they meet",
       {{"format", "string",
         "Format of the ridge lines; the path may end in it instead: ridges.glb. By default the Accept header "
         "decides, or else it is json.",
         format_names(crease::ridge_formats())}},
       {{200, "The ridge lines.", media_types(crease::ridge_formats()), "RidgeLines"},
        {206, "A range of their bytes.", media_types(crease::ridge_formats()), ""},
        {304, "The ridge lines in If-None-Match are current.", {}, ""}},
       with({code::kNotAcceptable, code::kRangeNotSatisfiable}),
       get_ridges},
      {"GET",
       "/v1/jobs/{id}/report",
       "get_report",
       "Download the report: input facts, parameters, energies of every sweep, result, timings",
       {{"format", "string", "Format of the report; the path may end in it instead: report.json.",
         format_names(crease::report_formats())}},
       {{200, "The report.", media_types(crease::report_formats()), "Report"}},
       with({}),
       get_report},
  };
}

}  // namespace creased
