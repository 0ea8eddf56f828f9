#include "proto/error_table.h"

#include <algorithm>
#include <array>
#include <string>

#include "core/base/text.h"

namespace crease {
namespace {

constexpr auto kTable = std::to_array<ErrorKind>({
    {code::kAddressConnectionsFull, "address_connections_full", 429, "This address has too many open connections", 1,
     ExitCode::kOverLimit},
    {code::kBodyIncomplete, "body_incomplete", 400, "The body is incomplete", 0, ExitCode::kUsage},
    {code::kBodyMissing, "body_missing", 400, "The request has no body", 0, ExitCode::kUsage},
    {code::kContentEncodingUnsupported, "content_encoding_unsupported", 415, "The content encoding is not supported", 0,
     ExitCode::kUsage},
    {code::kContentTypeUnsupported, "content_type_unsupported", 415, "The content type is not supported", 0,
     ExitCode::kUsage},
    {code::kEncodingFailed, "encoding_failed", 500, "The file could not be made within the limits", 0,
     ExitCode::kInternal},
    {code::kExpectationFailed, "expectation_failed", 417, "The expectation cannot be met", 0, ExitCode::kUsage},
    {code::kFileLimitExceeded, "file_limit_exceeded", 500, "The job exceeded its file size limit", 0,
     ExitCode::kInternal},
    {code::kFileUnreadable, "file_unreadable", 0, "A file cannot be read", 0, ExitCode::kFile},
    {code::kFileUnwritable, "file_unwritable", 0, "A file cannot be written", 0, ExitCode::kFile},
    {code::kForbidden, "forbidden", 403, "The key may not do this", 0, ExitCode::kKeyRefused},
    {code::kHeadersTooLarge, "headers_too_large", 431, "The headers are too large", 0, ExitCode::kUsage},
    {code::kHttpVersionUnsupported, "http_version_unsupported", 505, "The HTTP version is not supported", 0,
     ExitCode::kInternal},
    {code::kIdempotencyConflict, "idempotency_conflict", 422, "The Idempotency-Key was used for another request", 0,
     ExitCode::kUsage},
    {code::kInspectionFailed, "inspection_failed", 422, "The upload could not be inspected within the limits", 0,
     ExitCode::kInputRefused},
    {code::kInternal, "internal", 500, "Internal error", 0, ExitCode::kInternal},
    {code::kInterrupted, "interrupted", 0, "The command was interrupted", 0, ExitCode::kCancelled},
    {code::kJobCancelled, "job_cancelled", 409, "The job was cancelled", 0, ExitCode::kCancelled},
    {code::kJobFailed, "job_failed", 409, "The job failed", 0, ExitCode::kJobFailed},
    {code::kJobNotFinished, "job_not_finished", 409, "The job has not finished", 1, ExitCode::kNotFinished},
    {code::kJobNotFound, "job_not_found", 404, "The job does not exist", 0, ExitCode::kNotFound},
    {code::kJsonInvalid, "json_invalid", 400, "The JSON is not valid", 0, ExitCode::kUsage},
    {code::kKeyQueueFull, "key_queue_full", 429, "This key has too many queued jobs", 5, ExitCode::kOverLimit},
    {code::kKeyStreamsFull, "key_streams_full", 429, "This key has too many open event streams", 1,
     ExitCode::kOverLimit},
    {code::kLinkExpired, "link_expired", 410, "The link has expired", 0, ExitCode::kUsage},
    {code::kLinkInvalid, "link_invalid", 403, "The link is not valid", 0, ExitCode::kKeyRefused},
    {code::kMemoryExhausted, "memory_exhausted", 500, "The job exceeded its memory limit", 0, ExitCode::kInternal},
    {code::kMeshCountMismatch, "mesh_count_mismatch", 422, "The counts in the mesh file do not match its content", 0,
     ExitCode::kInputRefused},
    {code::kMeshEmpty, "mesh_empty", 422, "The mesh file is empty", 0, ExitCode::kInputRefused},
    {code::kMeshFormatUnknown, "mesh_format_unknown", 415, "The mesh format is unknown", 0, ExitCode::kInputRefused},
    {code::kMeshIndexOutOfRange, "mesh_index_out_of_range", 422, "A face refers to a vertex that does not exist", 0,
     ExitCode::kInputRefused},
    {code::kMeshMismatch, "mesh_mismatch", 422, "The meshes do not correspond", 0, ExitCode::kInputRefused},
    {code::kMeshNoExtent, "mesh_no_extent", 422, "All edges of the mesh have length zero", 0, ExitCode::kInputRefused},
    {code::kMeshNoFaces, "mesh_no_faces", 422, "The mesh has no faces", 0, ExitCode::kInputRefused},
    {code::kMeshNotFinite, "mesh_not_finite", 422, "A coordinate is not a finite number", 0, ExitCode::kInputRefused},
    {code::kMeshSyntax, "mesh_syntax", 422, "The mesh file cannot be read", 0, ExitCode::kInputRefused},
    {code::kMeshTooLarge, "mesh_too_large", 413, "The mesh is too large", 0, ExitCode::kInputRefused},
    {code::kMeshTruncated, "mesh_truncated", 422, "The mesh file ends early", 0, ExitCode::kInputRefused},
    {code::kMeshUnsupported, "mesh_unsupported", 422, "The mesh file uses a feature that is not supported", 0,
     ExitCode::kInputRefused},
    {code::kMethodNotAllowed, "method_not_allowed", 405, "The method is not allowed here", 0, ExitCode::kUsage},
    {code::kMultipartInvalid, "multipart_invalid", 400, "The multipart body is not valid", 0, ExitCode::kUsage},
    {code::kMultipartPartMissing, "multipart_part_missing", 400, "A part of the multipart body is missing", 0,
     ExitCode::kUsage},
    {code::kMultipartPartUnknown, "multipart_part_unknown", 400, "A part of the multipart body is unknown", 0,
     ExitCode::kUsage},
    {code::kNotAcceptable, "not_acceptable", 406, "None of the accepted media types is available", 0, ExitCode::kUsage},
    {code::kNotFound, "not_found", 404, "The resource does not exist", 0, ExitCode::kNotFound},
    {code::kOriginNotAllowed, "origin_not_allowed", 403, "Pages of this origin may not do this", 0,
     ExitCode::kKeyRefused},
    {code::kOutputFormatUnknown, "output_format_unknown", 400, "The output format is unknown", 0, ExitCode::kUsage},
    {code::kParameterInvalid, "parameter_invalid", 400, "A parameter has an invalid value", 0, ExitCode::kUsage},
    {code::kParameterOutOfRange, "parameter_out_of_range", 400, "A parameter is out of range", 0, ExitCode::kUsage},
    {code::kParameterUnknown, "parameter_unknown", 400, "A parameter is unknown", 0, ExitCode::kUsage},
    {code::kPayloadTooLarge, "payload_too_large", 413, "The body is too large", 0, ExitCode::kInputRefused},
    {code::kProcessUnavailable, "process_unavailable", 503, "No process could be started for this", 1,
     ExitCode::kServerUnreachable},
    {code::kProtobufInvalid, "protobuf_invalid", 400, "The protobuf message is not valid", 0, ExitCode::kUsage},
    {code::kQueueFull, "queue_full", 503, "Too many jobs are queued", 5, ExitCode::kServerUnreachable},
    {code::kQuotaExceeded, "quota_exceeded", 507, "The storage quota is used up", 0, ExitCode::kOverLimit},
    {code::kRangeNotSatisfiable, "range_not_satisfiable", 416, "The range cannot be satisfied", 0, ExitCode::kUsage},
    {code::kRateLimited, "rate_limited", 429, "Too many requests", 1, ExitCode::kOverLimit},
    {code::kRequestMalformed, "request_malformed", 400, "The request is not valid HTTP", 0, ExitCode::kUsage},
    {code::kRequestTimeout, "request_timeout", 408, "The request took too long to arrive", 0, ExitCode::kUsage},
    {code::kResultDamaged, "result_damaged", 500, "The stored result is damaged", 0, ExitCode::kInternal},
    {code::kServerUnreachable, "server_unreachable", 0, "The server cannot be reached", 0,
     ExitCode::kServerUnreachable},
    {code::kShuttingDown, "shutting_down", 503, "The service is shutting down", 1, ExitCode::kServerUnreachable},
    {code::kSnapshotUnavailable, "snapshot_unavailable", 409, "There is no snapshot of the job", 1,
     ExitCode::kNotFinished},
    {code::kStorageFull, "storage_full", 507, "The disk is full", 0, ExitCode::kOverLimit},
    {code::kStoreUnavailable, "store_unavailable", 503, "The job store is not available", 1,
     ExitCode::kServerUnreachable},
    {code::kTimeLimitExceeded, "time_limit_exceeded", 500, "The job exceeded its time limit", 0, ExitCode::kInternal},
    {code::kTooManyConnections, "too_many_connections", 503, "Too many connections are open", 1,
     ExitCode::kServerUnreachable},
    {code::kTooManyStreams, "too_many_streams", 503, "Too many event streams are open", 1,
     ExitCode::kServerUnreachable},
    {code::kTransferEncodingUnsupported, "transfer_encoding_unsupported", 501, "The transfer encoding is not supported",
     0, ExitCode::kInternal},
    {code::kUnauthorized, "unauthorized", 401, "A valid key is required", 0, ExitCode::kKeyRefused},
    {code::kUploadDamaged, "upload_damaged", 500, "The stored upload is missing or damaged", 0, ExitCode::kInternal},
    {code::kUriTooLong, "uri_too_long", 414, "The request target is too long", 0, ExitCode::kUsage},
    {code::kUsage, "usage", 0, "The command line is wrong", 0, ExitCode::kUsage},
    {code::kWeightsInvalid, "weights_invalid", 422, "The vertex weights are not valid", 0, ExitCode::kInputRefused},
    {code::kWorkerLost, "worker_lost", 500, "The job's workers failed too often", 0, ExitCode::kInternal},
});

constexpr bool is_in_order() {
  for (std::size_t i = 0; i < kTable.size(); ++i) {
    if (kTable[i].code != static_cast<ErrorCode>(i)) return false;
    if (i > 0 && kTable[i].name <= kTable[i - 1].name) return false;
  }
  return true;
}

static_assert(is_in_order(), "each code has its row, in the order of core/error_code.h, which is that of the names");
static_assert(kTable.size() == static_cast<std::size_t>(ErrorCode::kWorkerLost) + 1, "the last code has its row");

}  // namespace

std::span<const ErrorKind> error_table() { return kTable; }

const ErrorKind& error_kind(ErrorCode code) { return kTable[static_cast<std::size_t>(code)]; }

const ErrorKind* find_error_kind(std::string_view name) {
  const auto row = std::ranges::lower_bound(kTable, name, {}, &ErrorKind::name);
  return row != kTable.end() && row->name == name ? &*row : nullptr;
}

v1::Problem to_problem(const Error& error) {
  const ErrorKind& kind = error_kind(error.code());
  v1::Problem problem;
  problem.set_type("about:blank");
  problem.set_title(std::string(kind.title));
  problem.set_status(static_cast<std::uint32_t>(kind.status));
  problem.set_code(std::string(kind.name));
  problem.set_detail(valid_utf8(error.detail()));
  problem.set_place(valid_utf8(error.place()));
  problem.set_field(valid_utf8(error.field()));
  problem.set_value(valid_utf8(error.value()));
  problem.set_expected(error.expected());
  return problem;
}

Error to_error(const v1::Problem& problem) {
  const ErrorKind* const kind = find_error_kind(problem.code());
  const ErrorCode code = kind == nullptr ? code::kInternal : kind->code;
  if (problem.field().empty()) return {code, problem.detail(), problem.place()};
  return Error::parameter(code, problem.field(), problem.value(), problem.expected(), problem.place());
}

}  // namespace crease
