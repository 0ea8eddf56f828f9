#include <fmt/format.h>

#include <filesystem>

#include "client/cli/commands.h"
#include "client/cli/failure.h"
#include "client/cli/parameter_options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/service_client.h"
#include "core/io/formats.h"

namespace crease::client {
namespace {

using Json = nlohmann::ordered_json;

struct JobOptions {
  Console console;
  Server server;
  std::string id;
};

struct SubmitOptions {
  Console console;
  Server server;
  std::filesystem::path input, weights;
  std::string input_format;
  ParameterOptions parameters;
};

struct ListOptions {
  Console console;
  Server server;
  std::string state, cursor;
  std::string limit = "20";
};

void show_job(const Console& console, const Json& json) {
  const auto job = from_json<v1::Job>(json);
  std::string text = job_line(job);
  if (job.state() == "running") text += "\n" + progress_text(job.progress());
  if (job.state() == "failed") text += fmt::format("\n{}: {}", job.error().code(), job.error().detail());
  if (job.state() == "succeeded") text += "\n" + figures(job);
  console.result(json, text);
}

ExitCode submit(const SubmitOptions& options) {
  const v1::Parameters parameters = options.parameters.read();
  Interruption interruption;
  const Json json = ServiceClient(options.server, interruption)
                        .submit(options.input, options.input_format, options.weights, parameters);
  const auto job = from_json<v1::Job>(json);
  print_warnings(job);
  options.console.result(json, job.id());
  return ExitCode::kOk;
}

ExitCode status(const JobOptions& options) {
  Interruption interruption;
  show_job(options.console, ServiceClient(options.server, interruption).get("/v1/jobs/" + options.id));
  return ExitCode::kOk;
}

ExitCode watch(const JobOptions& options) {
  Interruption interruption;
  ProgressBar bar(ProgressBar::style(options.console.quiet));
  ServiceClient client(options.server, interruption);
  client.get("/v1/jobs/" + options.id);  // fails at once when there is no such job
  const Json json = client.follow(options.id, [&](const v1::Progress& progress) { bar.update(progress); });
  bar.finish();
  show_job(options.console, json);
  const auto state = json.at("state").get<std::string>();
  return state == "succeeded" ? ExitCode::kOk : state == "failed" ? ExitCode::kJobFailed : ExitCode::kCancelled;
}

ExitCode cancel(const JobOptions& options) {
  Interruption interruption;
  show_job(options.console, ServiceClient(options.server, interruption).post("/v1/jobs/" + options.id + "/cancel"));
  return ExitCode::kOk;
}

ExitCode remove(const JobOptions& options) {
  Interruption interruption;
  ServiceClient(options.server, interruption).remove("/v1/jobs/" + options.id);
  options.console.result({{"deleted", options.id}}, "deleted " + options.id);
  return ExitCode::kOk;
}

ExitCode list(const ListOptions& options) {
  Interruption interruption;
  Query query = {{"limit", options.limit}};
  if (!options.state.empty()) query.emplace("state", options.state);
  if (!options.cursor.empty()) query.emplace("cursor", options.cursor);
  const Json json = ServiceClient(options.server, interruption).get("/v1/jobs", query);
  const auto page = from_json<v1::JobList>(json);
  std::string text = page.jobs().empty() ? "no jobs" : "";
  for (const v1::Job& job : page.jobs()) text += (text.empty() ? "" : "\n") + job_line(job);
  if (page.has_next_cursor()) text += fmt::format("\nmore: --cursor {}", page.next_cursor());
  options.console.result(json, text);
  return ExitCode::kOk;
}

void add_job_command(CLI::App& app, Run& run, const std::string& name, const std::string& description,
                     ExitCode (*body)(const JobOptions&)) {
  CLI::App& command = *app.add_subcommand(name, description);
  auto options = std::make_shared<JobOptions>();
  command.add_option("id", options->id, "Id of the job")->required();
  add_server_options(command, options->server);
  add_console_options(command, options->console);
  run_with(command, run, options, body);
}

void add_submit_command(CLI::App& app, Run& run) {
  CLI::App& command = *app.add_subcommand("submit", "Upload a mesh and print the id of its job");
  auto options = std::make_shared<SubmitOptions>();
  command.add_option("input", options->input, "Noisy mesh: " + name_list(formats_with(&Format::read)))->required();
  command.add_option("--input-format", options->input_format,
                     "Format of the input; by default it is guessed from the name, then the bytes");
  add_weights_option(command, options->weights);
  add_parameter_options(command, options->parameters);
  add_server_options(command, options->server);
  add_console_options(command, options->console);
  run_with(command, run, options, submit);
}

void add_list_command(CLI::App& app, Run& run) {
  CLI::App& command = *app.add_subcommand("list", "List jobs, newest first");
  auto options = std::make_shared<ListOptions>();
  command.add_option("--state", options->state,
                     "List only jobs in this state: queued, running, succeeded, failed or cancelled");
  command.add_option("--limit", options->limit, "Number of jobs to list")->capture_default_str();
  command.add_option("--cursor", options->cursor, "Where to continue, as printed by the previous call");
  add_server_options(command, options->server);
  add_console_options(command, options->console);
  run_with(command, run, options, list);
}

}  // namespace

void add_job_commands(CLI::App& app, Run& run) {
  add_submit_command(app, run);
  add_job_command(app, run, "status", "Show a job", status);
  add_job_command(app, run, "watch", "Follow a job to its end; Ctrl-C leaves it running", watch);
  add_job_command(app, run, "cancel", "Cancel a job", cancel);
  add_job_command(app, run, "delete", "Delete a job and all its data", remove);
  add_list_command(app, run);
}

}  // namespace crease::client
