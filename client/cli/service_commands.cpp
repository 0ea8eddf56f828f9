#include <cstdlib>

#include "client/cli/commands.h"
#include "client/cli/parameter_options.h"
#include "client/cli/service_client.h"
#include "proto/parameter_table.h"

namespace crease::client {
namespace {

struct ServiceOptions {
  Console console;
  std::string server;
};

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

CLI::Option* add_server_option(CLI::App& command, std::string& server) {
  // Not through CLI11: a variable that is merely set must not exclude --local as --server does.
  const char* const variable = std::getenv("CREASED_URL");  // NOLINT(concurrency-mt-unsafe): before any thread
  server = variable != nullptr && *variable != '\0' ? variable : kDefaultServer;
  return command.add_option("--server", server, "URL of the service; otherwise CREASED_URL")->capture_default_str();
}

void add_weights_option(CLI::App& command, std::filesystem::path& weights) {
  command.add_option("--weights", weights,
                     "Weights of the likelihood: a JSON array with a number from 0 to 1000000 for every vertex");
}

void add_service_commands(CLI::App& app, Run& run) {
  const auto of_parameters = std::make_shared<ServiceOptions>();
  CLI::App& parameters_command = *app.add_subcommand("parameters", "List the parameters; with --json as JSON Schema");
  add_console_options(parameters_command, of_parameters->console);
  run_with(parameters_command, run, of_parameters, parameters);

  const auto of_health = std::make_shared<ServiceOptions>();
  CLI::App& health_command = *app.add_subcommand("health", "Ask whether the service takes jobs");
  add_server_option(health_command, of_health->server);
  add_console_options(health_command, of_health->console);
  run_with(health_command, run, of_health, health);
}

}  // namespace crease::client
