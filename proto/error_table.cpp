#include "proto/error_table.h"

#include <algorithm>
#include <array>
#include <string>

#include "core/base/text.h"

namespace crease {
namespace {

constexpr std::array kTable = std::to_array<ErrorKind>({
    {"address_connections_full", 429, "This address has too many open connections"},
    {"body_incomplete", 400, "The body is incomplete"},
    {"body_missing", 400, "The request has no body"},
    {"content_encoding_unsupported", 415, "The content encoding is not supported"},
    {"content_type_unsupported", 415, "The content type is not supported"},
    {"encoding_failed", 500, "The file could not be made within the limits"},
    {"expectation_failed", 417, "The expectation cannot be met"},
    {"file_limit_exceeded", 500, "The job exceeded its file size limit"},
    {"forbidden", 403, "The key may not do this"},
    {"headers_too_large", 431, "The headers are too large"},
    {"http_version_unsupported", 505, "The HTTP version is not supported"},
    {"idempotency_conflict", 422, "The Idempotency-Key was used for another request"},
    {"inspection_failed", 422, "The upload could not be inspected within the limits"},
    {"internal", 500, "Internal error"},
    {"job_cancelled", 409, "The job was cancelled"},
    {"job_failed", 409, "The job failed"},
    {"job_not_finished", 409, "The job has not finished"},
    {"job_not_found", 404, "The job does not exist"},
    {"json_invalid", 400, "The JSON is not valid"},
    {"key_queue_full", 429, "This key has too many queued jobs"},
    {"key_streams_full", 429, "This key has too many open event streams"},
    {"link_expired", 410, "The link has expired"},
    {"link_invalid", 403, "The link is not valid"},
    {"memory_exhausted", 500, "The job exceeded its memory limit"},
    {"mesh_count_mismatch", 422, "The counts in the mesh file do not match its content"},
    {"mesh_empty", 422, "The mesh file is empty"},
    {"mesh_format_unknown", 415, "The mesh format is unknown"},
    {"mesh_index_out_of_range", 422, "A face refers to a vertex that does not exist"},
    {"mesh_mismatch", 422, "The meshes do not correspond"},
    {"mesh_no_extent", 422, "All edges of the mesh have length zero"},
    {"mesh_no_faces", 422, "The mesh has no faces"},
    {"mesh_not_finite", 422, "A coordinate is not a finite number"},
    {"mesh_syntax", 422, "The mesh file cannot be read"},
    {"mesh_too_large", 413, "The mesh is too large"},
    {"mesh_truncated", 422, "The mesh file ends early"},
    {"mesh_unsupported", 422, "The mesh file uses a feature that is not supported"},
    {"method_not_allowed", 405, "The method is not allowed here"},
    {"multipart_invalid", 400, "The multipart body is not valid"},
    {"multipart_part_missing", 400, "A part of the multipart body is missing"},
    {"multipart_part_unknown", 400, "A part of the multipart body is unknown"},
    {"not_acceptable", 406, "None of the accepted media types is available"},
    {"not_found", 404, "The resource does not exist"},
    {"origin_not_allowed", 403, "Pages of this origin may not do this"},
    {"output_format_unknown", 400, "The output format is unknown"},
    {"parameter_invalid", 400, "A parameter has an invalid value"},
    {"parameter_out_of_range", 400, "A parameter is out of range"},
    {"parameter_unknown", 400, "A parameter is unknown"},
    {"payload_too_large", 413, "The body is too large"},
    {"process_unavailable", 503, "No process could be started for this"},
    {"protobuf_invalid", 400, "The protobuf message is not valid"},
    {"queue_full", 503, "Too many jobs are queued"},
    {"quota_exceeded", 507, "The storage quota is used up"},
    {"range_not_satisfiable", 416, "The range cannot be satisfied"},
    {"rate_limited", 429, "Too many requests"},
    {"request_malformed", 400, "The request is not valid HTTP"},
    {"request_timeout", 408, "The request took too long to arrive"},
    {"result_damaged", 500, "The stored result is damaged"},
    {"shutting_down", 503, "The service is shutting down"},
    {"snapshot_unavailable", 409, "There is no snapshot of the job"},
    {"storage_full", 507, "The disk is full"},
    {"store_unavailable", 503, "The job store is not available"},
    {"time_limit_exceeded", 500, "The job exceeded its time limit"},
    {"too_many_connections", 503, "Too many connections are open"},
    {"too_many_streams", 503, "Too many event streams are open"},
    {"transfer_encoding_unsupported", 501, "The transfer encoding is not supported"},
    {"unauthorized", 401, "A valid key is required"},
    {"upload_damaged", 500, "The stored upload is missing or damaged"},
    {"uri_too_long", 414, "The request target is too long"},
    {"weights_invalid", 422, "The vertex weights are not valid"},
    {"worker_lost", 500, "The job's workers failed too often"},
});

}  // namespace

std::span<const ErrorKind> error_table() { return kTable; }

const ErrorKind& error_kind(std::string_view code) {
  const auto row = std::ranges::lower_bound(kTable, code, {}, &ErrorKind::code);
  if (row != kTable.end() && row->code == code) return *row;
  return *std::ranges::lower_bound(kTable, "internal", {}, &ErrorKind::code);
}

v1::Problem to_problem(const Error& error) {
  const ErrorKind& kind = error_kind(error.code());
  v1::Problem problem;
  problem.set_type("about:blank");
  problem.set_title(std::string(kind.title));
  problem.set_status(static_cast<std::uint32_t>(kind.status));
  problem.set_code(std::string(kind.code));
  problem.set_detail(valid_utf8(error.detail()));
  problem.set_place(valid_utf8(error.place()));
  problem.set_field(valid_utf8(error.field()));
  problem.set_value(valid_utf8(error.value()));
  problem.set_expected(error.expected());
  return problem;
}

Error to_error(const v1::Problem& problem) {
  if (problem.field().empty()) return {problem.code(), problem.detail(), problem.place()};
  return Error::parameter(problem.code(), problem.field(), problem.value(), problem.expected(), problem.place());
}

}  // namespace crease
