#include "server/api/submit.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "core/base/text.h"
#include "proto/assembly.h"
#include "proto/convert.h"
#include "proto/parameter_table.h"
#include "server/api/file_name.h"
#include "server/api/jobs.h"
#include "server/api/upload.h"
#include "server/jobs/needs.h"

namespace creased {
namespace code = crease::code;
namespace {

using crease::Error;
using crease::trimmed;
using std::chrono::seconds;

constexpr seconds kLongestWait{60};

/// The `wait` preference of a Prefer header [RFC 7240], at most kLongestWait. A malformed preference is ignored.
std::optional<seconds> preferred_wait(std::string_view prefer) {
  while (!prefer.empty()) {
    const auto comma = std::min(prefer.find(','), prefer.size());
    const std::string_view preference = trimmed(prefer.substr(0, comma));
    prefer.remove_prefix(std::min(comma + 1, prefer.size()));
    if (!preference.starts_with("wait=")) continue;
    std::uint32_t value = 0;
    const char* const end = preference.data() + preference.size();
    const auto [stop, error] = std::from_chars(preference.data() + 5, end, value);
    if (stop != end || error == std::errc::invalid_argument) return std::nullopt;
    if (error != std::errc()) return kLongestWait;
    return std::min(seconds(value), kLongestWait);
  }
  return std::nullopt;
}

std::string idempotency_key(const RequestHead& head) {
  std::string key(head.header("Idempotency-Key"));
  const bool given = head.count("Idempotency-Key") > 0;
  const bool visible = std::all_of(key.begin(), key.end(), [](unsigned char c) { return c > 0x20 && c < 0x7f; });
  if (given && (key.empty() || key.size() > 255 || !visible || head.count("Idempotency-Key") > 1)) {
    throw Error::parameter(code::kParameterInvalid, "Idempotency-Key", key, "1 to 255 visible ASCII characters");
  }
  return key;
}

/// The parameters with the time to keep the job and its threads: its own, or else the service's defaults.
crease::v1::Parameters with_defaults(crease::v1::Parameters parameters, const Services& services) {
  const auto& [defaults, maxima] = services.parameters;
  if (parameters.threads() == 0 && services.threads > 0) parameters.set_threads(services.threads);
  if (!parameters.has_retention_hours()) parameters.set_retention_hours(defaults.retention_hours());
  if (parameters.retention_hours() > maxima.retention_hours()) {
    throw Error::parameter(code::kParameterOutOfRange, "retention_hours",
                           fmt::format("{}", parameters.retention_hours()),
                           fmt::format("a number from 0 to {}", maxima.retention_hours()));
  }
  return parameters;
}

/// The id of a job. It depends on the owner, so that nobody can find out from an id whether another owner has submitted
/// the same mesh and parameters.
std::string id_for(const std::string& owner, const std::string& fingerprint) {
  if (owner.empty()) return fingerprint;
  return crease::sha256_hex(owner + "\n" + fingerprint).substr(0, fingerprint.size());
}

void check_faces(const crease::v1::InputFacts& input, const Limits& limits) {
  if (input.faces() <= limits.max_faces) return;
  throw Error(code::kMeshTooLarge,
              fmt::format("the mesh has {} faces; this caller may send at most {}", input.faces(), limits.max_faces));
}

/// Refuses a job that its process could not finish within the memory that there is for one.
void check_memory(const crease::v1::Job& job, std::uint64_t available) {
  constexpr std::uint64_t kMiB = 1U << 20U;
  const std::uint64_t needed = needs_of(job.input(), job.parameters()).memory_bytes;
  if (needed <= available) return;
  throw Error::parameter(
      code::kMeshTooLarge, "mesh", fmt::format("{} vertices and {} faces", job.input().vertices(), job.input().faces()),
      fmt::format("a mesh whose job needs at most {} MiB of memory; this one may need {} MiB with threads={}",
                  available / kMiB, (needed + kMiB - 1) / kMiB, job.parameters().threads()));
}

NewJob inspected(Services& services, const Caller& caller, const Submission& submission) {
  const std::string name = clean_file_name(submission.name);
  NewJob job;
  job.upload = submission.mesh->path();
  if (submission.weights != nullptr) job.weights = submission.weights->path();
  Inspection inspection =
      services.inspector.inspect({job.upload, submission.format, name, job.weights, caller.owner()});
  check_faces(inspection.facts, caller.limits);
  crease::describe_upload(inspection.facts, name, submission.mesh->bytes(), submission.mesh->sha256());
  const crease::v1::Job settled =
      crease::settled(inspection.facts, with_defaults(submission.parameters, services), inspection.warnings);
  check_memory(settled, services.job_memory_bytes);
  job.owner = caller.owner();
  job.owner_limits = {caller.limits.max_queued, std::uint64_t{caller.limits.max_stored_mb} << 20U};
  job.input = settled.input();
  job.parameters = settled.parameters();
  job.warnings = {settled.warnings().begin(), settled.warnings().end()};
  job.fingerprint = id_for(job.owner, settled.id());
  job.request_digest = crease::sha256_hex(job.input.sha256() + "\n" + job.input.format() + "\n" +
                                          job.input.weights_sha256() + "\n" + crease::to_json(job.parameters).dump());
  return job;
}

crease::v1::Job wait_for_end(Services& services, const crease::v1::Job& submitted, const Call& call, seconds time) {
  constexpr std::chrono::milliseconds kLook{500};
  const auto deadline = JobWatcher::Clock::now() + time;
  const auto subscription = services.watcher.subscribe(submitted.id());
  if (subscription == nullptr) return submitted;
  auto view = subscription->wait_newer(0, deadline);
  while (view != nullptr && !is_terminal(view->job.state())) {
    const auto now = JobWatcher::Clock::now();
    if (now >= deadline || services.watcher.closed() || call.exchange.stream.peer_gone()) break;
    view = subscription->wait_newer(view->version, std::min(deadline, now + kLook));
  }
  return view == nullptr ? submitted : view->job;
}

void submit_job(Services& services, Call& call) {
  const RequestHead& head = call.exchange.head;
  const std::string key = idempotency_key(head);
  const std::optional<seconds> wait = preferred_wait(head.header("Prefer"));

  const Submission submission = receive_submission(call.exchange, call.request, *call.body, services.store);
  NewJob new_job = inspected(services, call.caller(), submission);
  new_job.idempotency_key = key;
  bool created = false;
  crease::v1::Job job = services.store.submit(new_job, created);
  if (created) {
    services.metrics.count_state(job.id(), job.state());
  } else {
    call.response.set_header("Idempotent-Replayed", "true");
  }
  if (wait) {
    job = wait_for_end(services, job, call, *wait);
    call.response.set_header("Preference-Applied", "wait=" + std::to_string(wait->count()));
  }
  call.response.status = wait && is_terminal(job.state()) ? 200 : 202;
  call.response.set_header("Location", call.exchange.base + "/v1/jobs/" + job.id());
  // An earlier job with the same result does not know which parameters this request gave in vain.
  for (const auto& warning : new_job.warnings) crease::add_once(warning, *job.mutable_warnings());
  call.response.set_content(job_json(job, call.exchange.base), "application/json");
}

std::vector<crease::ErrorCode> submit_problems() {
  return {
      code::kMeshCountMismatch, code::kMeshEmpty,           code::kMeshFormatUnknown,    code::kMeshIndexOutOfRange,
      code::kMeshNoExtent,      code::kMeshNoFaces,         code::kMeshNotFinite,        code::kMeshSyntax,
      code::kMeshTooLarge,      code::kMeshTruncated,       code::kMeshUnsupported,      code::kInspectionFailed,
      code::kBodyMissing,       code::kBodyIncomplete,      code::kPayloadTooLarge,      code::kContentTypeUnsupported,
      code::kJsonInvalid,       code::kMultipartInvalid,    code::kMultipartPartMissing, code::kMultipartPartUnknown,
      code::kProtobufInvalid,   code::kIdempotencyConflict, code::kParameterInvalid,     code::kParameterOutOfRange,
      code::kQueueFull,         code::kKeyQueueFull,        code::kQuotaExceeded,        code::kStorageFull,
      code::kStoreUnavailable,  code::kShuttingDown,        code::kWeightsInvalid,       code::kProcessUnavailable};
}

}  // namespace

std::vector<Route> submit_routes() {
  return {{"POST",
           "/v1/jobs",
           "submit_job",
           "Submit a mesh for smoothing",
           {{"name", "string", "File name of the mesh. It is shown in lists, and its extension may tell the format."},
            {"format", "string",
             "Format of the mesh. By default it is found from the media type, the name, then the bytes.",
             format_names(crease::formats_with(&crease::Format::read))}},
           {{202, "The job is accepted. Location is its path.", {kJson}, "Job"},
            {200, "The job ended within the time that `Prefer: wait` allowed.", {kJson}, "Job"}},
           submit_problems(),
           submit_job}};
}

}  // namespace creased
