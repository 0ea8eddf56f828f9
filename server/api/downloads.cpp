#include "server/api/downloads.h"

#include <fmt/format.h>

#include <vector>

#include "proto/convert.h"
#include "proto/result_formats.h"
#include "server/api/file_name.h"
#include "server/transport/accept.h"

namespace creased {
namespace {

using crease::Error;
using crease::Format;

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
  if (!chosen) throw Error("not_acceptable", fmt::format("available media types: {}", fmt::join(types, ", ")));
  return *offered[*chosen];
}

void require_success(const crease::v1::Job& job) {
  if (job.state() == "succeeded") return;
  if (job.state() == "cancelled") throw Error("job_cancelled", "the job was cancelled and has no result");
  if (job.state() == "failed") throw Error("job_failed", job.error().code() + ": " + job.error().detail());
  throw Error("job_not_finished", "the job is " + job.state());
}

std::string etag(const crease::v1::Job& job, const std::string& what) {
  return fmt::format("{}-{}-{}", crease::job_fingerprint(job.input(), job.parameters()), CREASE_VERSION, what);
}

std::string disposition(const crease::v1::Job& job, std::string_view part, const Format& format) {
  return attachment(job.input().name(), job.id(), part, format.extensions.front());
}

}  // namespace

void Downloads::get_mesh(Call& call) {
  const auto job = find_job(store_, call);
  const Format& format = wanted_format(call, crease::mesh_formats());
  const bool snapshot = query_flag(call.request.params, "snapshot") && !is_terminal(job.state());
  if (!snapshot) require_success(job);
  const bool measured = query_flag(call.request.params, "measured");
  if (measured && snapshot) {
    throw Error::parameter("parameter_invalid", "measured", "true", "false, or left out, with snapshot=true");
  }
  const std::string extension(format.extensions.front());
  Download download;
  download.media_type = format.media_types.front();
  download.disposition = disposition(job, measured ? "measured" : "smooth", format);
  download.etag = snapshot ? "" : etag(job, (measured ? "measured-" : "") + extension);
  download.file = snapshot   ? files_.snapshot(job, format)
                  : measured ? files_.measured(job, format)
                             : files_.mesh(job, format);
  send_file(call, download);
}

void Downloads::get_labels(Call& call) {
  const auto job = find_job(store_, call);
  require_success(job);
  const Format& format = named_format(call, crease::label_formats());
  const double min = query_number(call.request.params, "min", 0);
  Download download;
  download.media_type = format.media_types.front();
  download.disposition = disposition(job, "labels", format);
  download.etag = etag(job, fmt::format("labels-{}-{}", min, format.name));
  download.file = files_.labels(job, format, min);
  send_file(call, download);
}

void Downloads::get_ridges(Call& call) {
  const auto job = find_job(store_, call);
  const Format& format = wanted_format(call, crease::ridge_formats());
  require_success(job);
  Download download;
  download.media_type = format.media_types.front();
  download.disposition = disposition(job, "ridges", format);
  download.etag = etag(job, fmt::format("ridges-{}", format.name));
  download.file = files_.ridges(job, format);
  send_file(call, download);
}

void Downloads::get_report(Call& call) {
  const auto job = find_job(store_, call);
  require_success(job);
  const std::string bytes = reports_.read(job.id(), file::kReport);
  const Format& format = named_format(call, crease::report_formats());
  const std::string media_type(format.media_types.front());
  call.response.set_header("Content-Disposition", disposition(job, "report", format));
  if (&format == &crease::kProtobuf) return call.response.set_content(bytes, media_type);
  crease::v1::Report report;
  if (bytes.empty() || !report.ParseFromString(bytes))
    throw Error(code::kResultDamaged, "the report of the job cannot be read");
  call.response.set_content(crease::json_text(report), media_type);
}

}  // namespace creased
