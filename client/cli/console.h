#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "client/cli/exit_code.h"
#include "crease/v1/job.pb.h"

namespace crease::client {

/// The chosen command. It is set while the command line is parsed and run afterwards.
using Run = std::function<ExitCode()>;

/// How a command prints. Results go to standard output, everything else to standard error.
struct Console {
  bool json = false;
  bool quiet = false;

  /// Prints the result: `object` with --json, otherwise `text` unless --quiet is given.
  void result(const nlohmann::ordered_json& object, const std::string& text) const;
};

void add_console_options(CLI::App& command, Console& console);

/// Runs `body` when the command line names `command`.
template <typename Options>
void run_with(CLI::App& command, Run& run, std::shared_ptr<Options> options, ExitCode (*body)(const Options&)) {
  command.callback([&run, options, body] { run = [options, body] { return body(*options); }; });
}

/// One line about a job: id, state, progress, name, faces.
std::string job_line(const v1::Job& job);
/// The figures of a finished job: input, ridges, displacement, volume, time.
std::string figures(const v1::Job& job);
/// Prints the warnings to standard error, one per line.
void print_warnings(const v1::Job& job);
void print_warning(std::string_view code, std::string_view detail);

}  // namespace crease::client
