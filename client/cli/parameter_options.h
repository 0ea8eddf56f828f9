#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "crease/v1/parameters.pb.h"

namespace crease::client {

/// The options -p name=value, --seed and --threads.
struct ParameterOptions {
  std::vector<std::string> assignments;
  std::string seed, threads;

  /// \throw Error as set_parameter does; parameter_invalid also for an option that is not name=value or is repeated
  v1::Parameters read() const;
};

/// Adds the options, and the table of parameters to the help of the command.
void add_parameter_options(CLI::App& command, ParameterOptions& options);

/// Every parameter with its range, unit, default and meaning.
std::string parameter_help();

}  // namespace crease::client
