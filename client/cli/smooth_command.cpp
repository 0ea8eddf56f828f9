#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "client/cli/commands.h"
#include "client/cli/failure.h"
#include "client/cli/files.h"
#include "client/cli/local_job.h"
#include "client/cli/parameter_options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/service_client.h"
#include "client/cli/style_options.h"
#include "core/io/dropped_attributes.h"
#include "proto/assembly.h"
#include "proto/convert.h"
#include "proto/error_table.h"
#include "proto/result_formats.h"

namespace crease::client {
namespace {

using Json = nlohmann::ordered_json;

struct SmoothOptionsOfCommand {
  Console console;
  std::filesystem::path input, weights, output, labels, ridges, report;
  std::string input_format, format;
  Server server;
  ParameterOptions parameters;
  StyleOptions style;
  bool local = false;
};

/// The format by the file's extension; the first one without a file. \throw Error output_format_unknown
const Format& format_by_extension(const std::filesystem::path& path, const Formats& formats, std::string_view what) {
  if (path.empty()) return *formats.front();
  const Format* format = find_by_filename(formats, path.string());
  if (format != nullptr) return *format;
  throw Error(code::kOutputFormatUnknown,
              fmt::format("{} can be written as {}, not as {}", what, name_list(formats), path.string()));
}

/// Formats and parameters, checked before any work is done.
struct Plan {
  v1::Parameters parameters;
  const Format* format;  ///< null for the input's own file
  const Format& label_format;
  const Format& ridge_format;
};

Plan plan(const SmoothOptionsOfCommand& options) {
  const Format* format = options.format == kOriginal ? nullptr : &output_format(options.format, options.output);
  options.style.check(format);
  return {options.parameters.read(), format, format_by_extension(options.labels, label_formats(), "labels"),
          format_by_extension(options.ridges, ridge_formats(), "ridge lines")};
}

/// Whether the mesh is written as the input's own file: by default, where that has the format of the output.
bool writes_original(const SmoothOptionsOfCommand& options, const Plan& plan, const v1::Job& job) {
  return plan.format == nullptr ||
         (options.format.empty() && !options.style.any() && job.input().format() == plan.format->name);
}

/// The warnings of the job. What is dropped depends on the format that is written.
void settle_dropped(v1::Job& job, const Format* written) {
  const std::vector<std::string> attributes(job.input().attributes().begin(), job.input().attributes().end());
  const std::string dropped = written == nullptr ? "" : dropped_text(*written, attributes);
  auto& warnings = *job.mutable_warnings();
  const auto found = std::ranges::find(warnings, kAttributesDropped, [](const auto& one) { return one.code(); });
  if (found == warnings.end()) return;
  if (dropped.empty()) {
    warnings.erase(found);
  } else {
    found->set_detail(dropped + "; format=original does");
  }
}

Json smooth_locally(const SmoothOptionsOfCommand& options, const Plan& plan, ProgressBar& bar,
                    const Interruption& interruption) {
  const auto show = [&](const v1::Progress& progress) { bar.update(progress); };
  LocalJob local =
      run_local_job(options.input, options.input_format, options.weights, plan.parameters, show, interruption);
  const auto part = [&](v1::ResultPart what, const Format& format) {
    return encode(what, format, local.result, local.job, 0, options.style.read());
  };
  const bool as_original = writes_original(options, plan, local.job);
  if (!as_original && takes_over(local.job.input(), *plan.format)) {
    local.result.appearance = appearance_of(local.job.input(), local.upload);
  }
  write_file(options.output, as_original ? original(local.job.input(), local.upload, local.result)
                                         : part(v1::RESULT_PART_MESH, *plan.format));
  if (!options.labels.empty()) write_file(options.labels, part(v1::RESULT_PART_LABELS, plan.label_format));
  if (!options.ridges.empty()) write_file(options.ridges, part(v1::RESULT_PART_RIDGES, plan.ridge_format));
  if (!options.report.empty()) write_file(options.report, encode(*report_formats().front(), local.report));
  return to_json(local.job);
}

/// \throw Failure with the job's error when it did not succeed
void require_success(const Json& json) {
  const auto job = from_json<v1::Job>(json);
  if (job.state() == "succeeded") return;
  if (job.state() == "cancelled") throw Failure(code::kJobCancelled, fmt::format("job {} was cancelled", job.id()));
  throw Failure(to_json(job.error()), ExitCode::kJobFailed);
}

void cancel(const Server& server, const std::string& id) {
  Interruption second;  // the first one was used up by the interruption
  ServiceClient(server, second).post("/v1/jobs/" + id + "/cancel");
}

/// Follows the job. Cancels it when the command is interrupted.
Json follow_or_cancel(ServiceClient& client, const SmoothOptionsOfCommand& options, const std::string& id,
                      ProgressBar& bar) {
  try {
    return client.follow(id, [&](const v1::Progress& progress) { bar.update(progress); });
  } catch (const Failure& failure) {
    if (failure.problem().at("code") == error_kind(code::kInterrupted).name) cancel(options.server, id);
    throw;
  }
}

Json smooth_remotely(const SmoothOptionsOfCommand& options, const Plan& plan, ProgressBar& bar,
                     Interruption& interruption) {
  ServiceClient client(options.server, interruption);
  const Json submitted = client.submit(options.input, options.input_format, options.weights, plan.parameters);
  const auto id = submitted.at("id").get<std::string>();
  Json job = follow_or_cancel(client, options, id, bar);
  require_success(job);
  const std::string path = "/v1/jobs/" + id;
  const bool original = writes_original(options, plan, from_json<v1::Job>(job));
  Query query = {{"format", std::string(original ? kOriginal : plan.format->name)}};
  options.style.add_to(query);
  client.download(path + "/mesh", query, options.output);
  if (!options.labels.empty()) {
    client.download(path + "/labels", {{"format", std::string(plan.label_format.name)}}, options.labels);
  }
  if (!options.ridges.empty()) {
    client.download(path + "/ridges", {{"format", std::string(plan.ridge_format.name)}}, options.ridges);
  }
  if (!options.report.empty()) client.download(path + "/report", {}, options.report);
  return job;
}

Json files_of(const SmoothOptionsOfCommand& options) {
  Json files = {{"mesh", options.output.string()}};
  if (!options.labels.empty()) files["labels"] = options.labels.string();
  if (!options.ridges.empty()) files["ridges"] = options.ridges.string();
  if (!options.report.empty()) files["report"] = options.report.string();
  return files;
}

ExitCode smooth(const SmoothOptionsOfCommand& options) {
  const Plan what = plan(options);
  Interruption interruption;
  ProgressBar bar(ProgressBar::style(options.console.quiet));
  Json json = options.local ? smooth_locally(options, what, bar, interruption)
                            : smooth_remotely(options, what, bar, interruption);
  bar.finish();
  auto job = from_json<v1::Job>(json);
  settle_dropped(job, writes_original(options, what, job) ? nullptr : what.format);
  json["warnings"] = to_json(job).at("warnings");
  print_warnings(job);
  options.console.result({{"job", json}, {"files", files_of(options)}},
                         fmt::format("{}\noutput         {}", figures(job), options.output.string()));
  return ExitCode::kOk;
}

}  // namespace

void add_smooth_command(CLI::App& app, Run& run) {
  CLI::App& command = *app.add_subcommand("smooth", "Smooth a mesh, keep its ridges and label them");
  auto options = std::make_shared<SmoothOptionsOfCommand>();
  command.add_option("input", options->input, "Noisy mesh: " + name_list(formats_with(&Format::read)))->required();
  command.add_option("-o,--output", options->output, "Output file; by default its extension gives the format")
      ->required();
  command.add_option("--format", options->format,
                     "Format of the output: " + name_list(formats_with(&Format::write)) +
                         ", or original: the input's own file with new positions and normals, the default where the "
                         "input has the format of the output's extension");
  command.add_option("--input-format", options->input_format,
                     "Format of the input; by default it is guessed from the name, then the bytes");
  command.add_option("--labels", options->labels,
                     "Also write the ridge labels of the edges, as " + name_list(label_formats()));
  command.add_option("--ridges", options->ridges, "Also write the ridge lines, as " + name_list(ridge_formats()));
  command.add_option("--report", options->report,
                     "Also write the energies of every sweep, counts and timings, as JSON");
  add_style_options(command, options->style);
  add_weights_option(command, options->weights);
  add_parameter_options(command, options->parameters);
  add_server_options(command, options->server);
  command.add_flag("--local", options->local, "Run in this process, without a service; the files are the same")
      ->excludes(command.get_option("--server"), command.get_option("--key"), command.get_option("--key-file"));
  add_console_options(command, options->console);
  run_with(command, run, options, smooth);
}

}  // namespace crease::client
