#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

#include "client/cli/commands.h"
#include "client/cli/failure.h"
#include "client/cli/files.h"
#include "client/cli/service_client.h"
#include "client/cli/style_options.h"
#include "proto/result_formats.h"

namespace crease::client {
namespace {

struct ResultOptions {
  Console console;
  Server server;
  std::string id, format, min;
  std::filesystem::path output;
  StyleOptions style;
  bool snapshot = false;
};

void describe_file(const ResultOptions& options, std::uint64_t bytes) {
  options.console.result({{"job", options.id}, {"file", options.output.string()}, {"bytes", bytes}},
                         fmt::format("wrote {}, {} bytes", options.output.string(), bytes));
}

/// Writes to the output file, or to standard output when there is none.
void deliver(const ResultOptions& options, const std::string& what, const Query& query) {
  Interruption interruption;
  ServiceClient client(options.server, interruption);
  const std::string path = "/v1/jobs/" + options.id + "/" + what;
  if (!options.output.empty()) return describe_file(options, client.download(path, query, options.output));
  const std::string body = client.download(path, query);
  fmt::print("{}{}", body, body.ends_with('\n') ? "" : "\n");
}

ExitCode mesh(const ResultOptions& options) {
  const Format* format = options.format == kOriginal ? nullptr : &output_format(options.format, options.output);
  options.style.check(format);
  Query query = {{"format", std::string(format == nullptr ? kOriginal : format->name)}};
  options.style.add_to(query);
  if (options.snapshot) query.emplace("snapshot", "true");
  deliver(options, "mesh", query);
  return ExitCode::kOk;
}

/// The format option, or else the output's extension, or else JSON.
std::string format_of(const ResultOptions& options) {
  if (!options.format.empty()) return options.format;
  const std::string extension = options.output.extension().string();
  return extension.empty() ? std::string(format_name(MeshFormat::kJson)) : extension.substr(1);
}

/// \throw Failure usage for a format that does not suit a terminal when there is no output file
void require_output(const ResultOptions& options, const Formats& formats, std::string_view what) {
  const Format* format = find_by_name(formats, format_of(options));
  if (!options.output.empty() || format == nullptr || format->is_text) return;
  throw Failure(code::kUsage, fmt::format("{} in {} need -o FILE", what, format->title));
}

ExitCode labels(const ResultOptions& options) {
  const std::string format = format_of(options);
  if (options.output.empty() && format != format_name(MeshFormat::kJson) && options.console.json) {
    throw Failure(code::kUsage, "--json prints labels as JSON; use -o to write a file in another format");
  }
  require_output(options, label_formats(), "labels");
  Query query = {{"format", format}};
  if (!options.min.empty()) query.emplace("min", options.min);
  deliver(options, "labels", query);
  return ExitCode::kOk;
}

ExitCode ridges(const ResultOptions& options) {
  require_output(options, ridge_formats(), "ridge lines");
  deliver(options, "ridges", {{"format", format_of(options)}});
  return ExitCode::kOk;
}

ExitCode report(const ResultOptions& options) {
  deliver(options, "report", {});
  return ExitCode::kOk;
}

std::shared_ptr<ResultOptions> add_result_command(CLI::App& app, Run& run, const std::string& name,
                                                  const std::string& description,
                                                  ExitCode (*body)(const ResultOptions&)) {
  CLI::App& command = *app.add_subcommand(name, description);
  auto options = std::make_shared<ResultOptions>();
  command.add_option("id", options->id, "Id of the job")->required();
  add_server_options(command, options->server);
  add_console_options(command, options->console);
  run_with(command, run, options, body);
  return options;
}

}  // namespace

void add_result_commands(CLI::App& app, Run& run) {
  const auto of_mesh = add_result_command(app, run, "mesh", "Download the smoothed mesh of a job", mesh);
  CLI::App& mesh_command = *app.get_subcommand("mesh");
  mesh_command.add_option("-o,--output", of_mesh->output, "Output file; by default its extension gives the format")
      ->required();
  mesh_command.add_option(
      "--format", of_mesh->format,
      "Format: " + name_list(mesh_formats()) + ", or original: the uploaded file with new positions and normals");
  add_style_options(mesh_command, of_mesh->style);
  mesh_command.add_flag("--snapshot", of_mesh->snapshot, "While the job is running, get its latest intermediate mesh");

  const auto of_labels = add_result_command(app, run, "labels", "Print or download the ridge labels of a job", labels);
  CLI::App& labels_command = *app.get_subcommand("labels");
  labels_command.add_option("-o,--output", of_labels->output, "Output file; the default is standard output");
  labels_command.add_option("--format", of_labels->format,
                            "Format: " + name_list(label_formats()) + "; by default the extension's");
  labels_command.add_option("--min", of_labels->min, "Only edges with at least this label, from 0 to 1");

  const auto of_ridges = add_result_command(app, run, "ridges", "Print or download the ridge lines of a job", ridges);
  CLI::App& ridges_command = *app.get_subcommand("ridges");
  ridges_command.add_option("-o,--output", of_ridges->output, "Output file; the default is standard output");
  ridges_command.add_option("--format", of_ridges->format,
                            "Format: " + name_list(ridge_formats()) + "; by default the extension's");

  const auto of_report = add_result_command(app, run, "report", "Print or download the report of a job", report);
  app.get_subcommand("report")->add_option("-o,--output", of_report->output,
                                           "Output file; the default is standard output");
}

}  // namespace crease::client
