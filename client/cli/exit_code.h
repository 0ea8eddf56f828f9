#pragma once

#include <string>
#include <string_view>

#include "proto/exit_code.h"

namespace crease::client {

/// The exit code for the name of an error code. For names that this client does not know, the HTTP status decides; 0
/// means that there is none.
ExitCode exit_code_of(std::string_view name, int status = 0);

/// All exit codes with their meanings, for `crease --help`.
std::string exit_code_help();

}  // namespace crease::client
