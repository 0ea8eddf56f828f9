#include "client/cli/local_job.h"

#include <fmt/chrono.h>

#include <chrono>

#include "client/cli/failure.h"
#include "client/cli/files.h"
#include "core/base/heap.h"
#include "core/base/stopwatch.h"
#include "core/job.h"
#include "proto/assembly.h"
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

}  // namespace

LocalJob run_local_job(const std::filesystem::path& mesh, const std::string& format,
                       const std::filesystem::path& weights, const v1::Parameters& parameters,
                       const std::function<void(const v1::Progress&)>& on_progress, const Interruption& interruption) {
  if (parameters.has_retention_hours()) {
    throw Error::parameter(code::kParameterInvalid, "retention_hours", fmt::format("{}", parameters.retention_hours()),
                           "no value with --local, which keeps no jobs");
  }
  const std::uint32_t threads = to_options(resolve(parameters)).threads;
  reserve_heap(half_of_memory());
  const std::string created_at = utc_now();
  const Stopwatch stopwatch;
  std::string bytes = read_file(mesh);
  const std::string name = mesh.filename().string();
  std::optional<std::string> weights_json;
  if (!weights.empty()) weights_json = read_file(weights);
  const CheckedInput input =
      check_upload({.bytes = bytes, .format = format, .name = name, .weights = weights_json, .threads = threads});
  v1::InputFacts facts = to_message(input);
  describe_upload(facts, name, bytes.size(), sha256_hex(bytes));
  std::vector<v1::Warning> warnings;
  for (const Warning& warning : input.warnings) warnings.push_back(to_message(warning));
  v1::Timings timings;
  timings.set_decode_seconds(stopwatch.seconds());

  LocalJob local;
  v1::Job& job = local.job;
  job = settled(facts, parameters, warnings);
  job.set_created_at(created_at);
  job.set_started_at(created_at);
  job.set_attempt(1);

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
  timings.set_smooth_seconds(output.facts.seconds);
  local.report = make_report(job, output, timings);
  local.result = std::move(output.result);
  local.upload = std::move(bytes);
  return local;
}

}  // namespace crease::client
