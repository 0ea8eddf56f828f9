#include "client/cli/local_job.h"

#include <fmt/chrono.h>

#include <chrono>

#include "client/cli/failure.h"
#include "client/cli/files.h"
#include "core/base/stopwatch.h"
#include "core/job.h"
#include "proto/convert.h"
#include "proto/parameter_table.h"

namespace crease::client {
namespace {

std::string utc_now() {
  const auto now = std::chrono::system_clock::now();
  const auto milliseconds =
      std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count() % 1000;
  return fmt::format("{:%FT%T}.{:03}Z", fmt::gmtime(std::chrono::system_clock::to_time_t(now)), milliseconds);
}

std::optional<MeshFormat> input_format(const std::filesystem::path& mesh, const std::string& format) {
  if (format.empty()) return format_from_filename(mesh.string());
  const auto named = format_from_name(format);
  if (!named) throw Error(crease::code::kMeshFormatUnknown, fmt::format("'{}' is not a mesh format", format));
  return named;
}

v1::InputFacts input_facts(const CheckedInput& input, const std::filesystem::path& mesh, std::string_view bytes) {
  v1::InputFacts facts = to_message(input);
  facts.set_name(mesh.filename().string());
  facts.set_bytes(static_cast<std::uint32_t>(bytes.size()));
  facts.set_sha256(sha256_hex(bytes));
  return facts;
}

v1::Report make_report(const v1::Job& job, const JobOutput& output, double decode_seconds) {
  v1::Report report;
  report.set_id(job.id());
  report.set_version(CREASE_VERSION);
  *report.mutable_input() = job.input();
  *report.mutable_parameters() = job.parameters();
  *report.mutable_result() = job.result();
  report.mutable_timings()->set_decode_seconds(decode_seconds);
  report.mutable_timings()->set_smooth_seconds(output.facts.seconds);
  for (const SweepRecord& record : output.sweeps) *report.add_sweeps() = to_message(record);
  *report.mutable_warnings() = job.warnings();
  return report;
}

}  // namespace

LocalJob run_local_job(const std::filesystem::path& mesh, const std::string& format,
                       const std::filesystem::path& weights, const v1::Parameters& parameters,
                       const std::function<void(const v1::Progress&)>& on_progress, const Interruption& interruption) {
  if (parameters.has_retention_hours()) {
    throw Error::parameter(crease::code::kParameterInvalid, "retention_hours",
                           fmt::format("{}", parameters.retention_hours()),
                           "no value with --local, which keeps no jobs");
  }
  LocalJob local;
  v1::Job& job = local.job;
  job.set_created_at(utc_now());
  job.set_started_at(job.created_at());
  job.set_attempt(1);
  std::vector<Warning> warnings;
  *job.mutable_parameters() = resolve(parameters, &warnings);

  const Stopwatch stopwatch;
  std::string bytes = read_file(mesh);
  std::optional<std::string> weights_json;
  if (!weights.empty()) weights_json = read_file(weights);
  const CheckedInput input = check_input(bytes, input_format(mesh, format), {}, weights_json);
  *job.mutable_input() = input_facts(input, mesh, bytes);
  job.set_id(job_fingerprint(job.input(), job.parameters()));
  warnings.insert(warnings.begin(), input.warnings.begin(), input.warnings.end());
  for (const Warning& warning : warnings) *job.add_warnings() = to_message(warning);
  const double decode_seconds = stopwatch.seconds();

  RunContext context;
  context.on_sweep = [&](const SweepView& view) {
    *job.mutable_progress() = to_message(view);
    on_progress(job.progress());
    return !interruption.requested();
  };
  JobOutput output = run_job(input, to_options(job.parameters()), context);
  interruption.check();
  for (const Warning& warning : output.warnings) *job.add_warnings() = to_message(warning);

  job.set_state("succeeded");
  job.mutable_progress()->set_stage("done");
  job.set_finished_at(utc_now());
  *job.mutable_result() = to_message(output.facts);
  local.report = make_report(job, output, decode_seconds);
  local.extras = mesh_extras(job.id(), job.parameters(), input.facts, output.facts);
  local.result = std::move(output.result);
  local.upload = std::move(bytes);
  return local;
}

}  // namespace crease::client
