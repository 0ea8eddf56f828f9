#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "client/cli/exit_code.h"
#include "crease/v1/job.pb.h"

namespace crease::client {

/// What the chosen command does; set while the command line is parsed, run afterwards.
using Run = std::function<ExitCode()>;

/// How a command speaks. Results go to standard output, everything else to standard error.
struct Console {
  bool json = false;
  bool quiet = false;

  /// The result: the object with --json, else the text unless --quiet.
  void result(const nlohmann::ordered_json& object, const std::string& text) const;
};

void add_console_options(CLI::App& command, Console& console);

/// Makes `command` the one to run when it is named.
template <typename Options>
void run_with(CLI::App& command, Run& run, std::shared_ptr<Options> options, ExitCode (*body)(const Options&)) {
  command.callback([&run, options, body] { run = [options, body] { return body(*options); }; });
}

/// "id  state  …", one line of a job.
std::string job_line(const v1::Job& job);
/// Input, ridges, displacement, volume, time: what a finished job found.
std::string figures(const v1::Job& job);
/// Warnings, one a line, on standard error.
void print_warnings(const v1::Job& job);

}  // namespace crease::client
