#include "server/http/downloads.h"

#include <fmt/format.h>

#include <array>
#include <fstream>

#include "proto/convert.h"
#include "server/http/accept.h"
#include "server/http/file_name.h"

namespace creased {
namespace {

using crease::Error;
using crease::MeshFormat;

constexpr std::array kMeshFormats = {MeshFormat::kGlb, MeshFormat::kGltf, MeshFormat::kObj, MeshFormat::kPly,
                                     MeshFormat::kStl, MeshFormat::kOff,  MeshFormat::kJson};
constexpr std::array kRidgeFormats = {MeshFormat::kJson, MeshFormat::kGlb};

/// The format that the query names, or else the one in `offered`, best first, that the Accept header prefers.
MeshFormat wanted_format(Call& call, std::span<const MeshFormat> offered) {
  const std::string named = call.query("format");
  if (!named.empty()) return *crease::format_from_name(named);
  call.response.set_header("Vary", "Accept");
  std::vector<std::string_view> types(offered.size());
  std::ranges::transform(offered, types.begin(), crease::media_type);
  const auto chosen = negotiate(call.exchange.head.header("Accept"), types);
  if (!chosen) throw Error("not_acceptable", fmt::format("available media types: {}", fmt::join(types, ", ")));
  return offered[*chosen];
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

std::string read_whole(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes(std::istreambuf_iterator<char>(file), {});
  if (!file.good() && !file.eof()) throw Error("store_unavailable", "the report of the job cannot be read");
  return bytes;
}

}  // namespace

void Downloads::get_mesh(Call& call) {
  const auto job = find_job(store_, call);
  const MeshFormat format = wanted_format(call, kMeshFormats);
  const bool snapshot = query_flag(call.request.params, "snapshot") && !is_terminal(job.state());
  if (!snapshot) require_success(job);
  const std::string extension(crease::format_name(format));
  Download download;
  download.media_type = crease::media_type(format);
  download.disposition = attachment(job.input().name(), job.id(), extension);
  download.etag = snapshot ? "" : etag(job, extension);
  download.file = snapshot ? files_.snapshot(job, format) : files_.mesh(job, format);
  send_file(call, download);
}

void Downloads::get_labels(Call& call) {
  const auto job = find_job(store_, call);
  require_success(job);
  const std::string format = call.query("format", "json");
  const double min = query_number(call.request.params, "min", 0);
  Download download;
  download.media_type = format == "json" ? "application/json" : format == "csv" ? "text/csv" : "application/x-protobuf";
  download.etag = etag(job, fmt::format("labels-{}-{}", min, format));
  download.file = files_.labels(job,
                                format == "json"  ? LabelFormat::kJson
                                : format == "csv" ? LabelFormat::kCsv
                                                  : LabelFormat::kProtobuf,
                                min);
  send_file(call, download);
}

void Downloads::get_ridges(Call& call) {
  const auto job = find_job(store_, call);
  const MeshFormat format = wanted_format(call, kRidgeFormats);
  require_success(job);
  Download download;
  download.media_type = crease::media_type(format);
  download.etag = etag(job, fmt::format("ridges-{}", crease::format_name(format)));
  download.file = files_.ridges(job, format == MeshFormat::kJson ? RidgeFormat::kJson : RidgeFormat::kGlb);
  send_file(call, download);
}

void Downloads::get_report(Call& call) {
  const auto job = find_job(store_, call);
  require_success(job);
  const std::string bytes = read_whole(store_.file_path(job.id(), file::kReport));
  if (call.query("format") == "pb") {
    call.response.set_content(bytes, "application/x-protobuf");
    return;
  }
  crease::v1::Report report;
  if (bytes.empty() || !report.ParseFromString(bytes))
    throw Error("store_unavailable", "the report of the job is damaged");
  call.response.set_content(crease::json_text(report), "application/json");
}

}  // namespace creased
