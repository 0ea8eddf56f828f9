#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <new>
#include <span>
#include <string_view>

#include "client/cli/commands.h"
#include "client/cli/failure.h"
#include "core/error.h"

namespace {

using crease::client::Failure;

int report(const Failure& failure, bool json) {
  fmt::print(stderr, "crease: {}\n", failure.what());
  if (json) fmt::print("{}\n", failure.problem().dump());
  return static_cast<int>(failure.exit_code());
}

/// Whether the arguments include --json, even when the command line cannot be parsed.
bool wants_json(std::span<char*> arguments) {
  for (const std::string_view argument : arguments) {
    if (argument == "--json") return true;
  }
  return false;
}

int run_command(int argc, char** argv) {
  CLI::App app("Removes noise from triangle meshes, keeps their ridges, and labels them.", "crease");
  app.set_version_flag("--version", "crease " CREASE_VERSION);
  app.require_subcommand(1);
  app.footer(crease::client::exit_code_help);
  crease::client::Run run;
  crease::client::add_smooth_command(app, run);
  crease::client::add_job_commands(app, run);
  crease::client::add_result_commands(app, run);
  crease::client::add_mesh_commands(app, run);
  crease::client::add_service_commands(app, run);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    throw Failure(crease::code::kUsage, error.what());
  }
  return static_cast<int>(run());
}

}  // namespace

int main(int argc, char** argv) {
  const bool json = wants_json({argv, static_cast<std::size_t>(argc)});
  try {
    return run_command(argc, argv);
  } catch (const Failure& failure) {
    return report(failure, json);
  } catch (const crease::Error& error) {
    return report(Failure(error), json);
  } catch (const std::bad_alloc&) {
    return report(Failure(crease::Error(crease::code::kMemoryExhausted, "out of memory")), json);
  } catch (const std::exception& error) {
    return report(Failure(crease::Error(crease::code::kInternal, error.what())), json);
  }
}
