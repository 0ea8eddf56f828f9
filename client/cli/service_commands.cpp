#include <cstdlib>

#include "client/cli/commands.h"
#include "client/cli/parameter_options.h"
#include "client/cli/service_client.h"
#include "proto/parameter_table.h"

namespace crease::client {
namespace {

struct ServiceOptions {
  Console console;
  Server server;
};

// CLI11's own environment variables would count as given options and so exclude --local.
std::string from_environment(const char* name, const char* fallback) {
  const char* const variable = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): before any thread
  return variable != nullptr && *variable != '\0' ? variable : fallback;
}

ExitCode parameters(const ServiceOptions& options) {
  options.console.result(parameters_schema(), parameter_help());
  return ExitCode::kOk;
}

ExitCode health(const ServiceOptions& options) {
  Interruption interruption;
  options.console.result(ServiceClient(options.server, interruption).get("/readyz"), "ready");
  return ExitCode::kOk;
}

}  // namespace

void add_server_options(CLI::App& command, Server& server) {
  server.url = from_environment("CREASED_URL", kDefaultServer);
  server.key = from_environment("CREASED_KEY", "");
  command.add_option("--server", server.url, "URL of the service; the default is CREASED_URL")->capture_default_str();
  auto* const key = command.add_option("--key", server.key,
                                       "API key; other users can see it in the list of processes, so prefer "
                                       "--key-file or CREASED_KEY");
  command
      .add_option_function<std::string>(
          "--key-file", [&server](const std::string& file) { server.key.clear(), server.key_file = file; },
          "File that starts with the API key")
      ->type_name("PATH")
      ->excludes(key);
}

void add_weights_option(CLI::App& command, std::filesystem::path& weights) {
  command.add_option(
      "--weights", weights,
      "Weights of the likelihood: a JSON file with an array of one number per vertex, each from 0 to 1000000");
}

void add_service_commands(CLI::App& app, Run& run) {
  const auto of_parameters = std::make_shared<ServiceOptions>();
  CLI::App& parameters_command = *app.add_subcommand("parameters", "List the parameters, with --json as JSON Schema");
  add_console_options(parameters_command, of_parameters->console);
  run_with(parameters_command, run, of_parameters, parameters);

  const auto of_health = std::make_shared<ServiceOptions>();
  CLI::App& health_command = *app.add_subcommand("health", "Check that the service accepts jobs");
  add_server_options(health_command, of_health->server);
  add_console_options(health_command, of_health->console);
  run_with(health_command, run, of_health, health);
}

}  // namespace crease::client
