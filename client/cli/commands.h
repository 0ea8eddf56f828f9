#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>

#include "client/cli/console.h"
#include "client/cli/service_client.h"

namespace crease::client {

/// Adds the command smooth.
void add_smooth_command(CLI::App& app, Run& run);
/// Adds the commands submit, status, watch, cancel, list and delete.
void add_job_commands(CLI::App& app, Run& run);
/// Adds the commands mesh, labels, ridges and report.
void add_result_commands(CLI::App& app, Run& run);
/// Adds the commands noise and measure.
void add_mesh_commands(CLI::App& app, Run& run);
/// Adds the commands parameters and health.
void add_service_commands(CLI::App& app, Run& run);

inline constexpr const char* kDefaultServer = "http://127.0.0.1:8080";

/// Adds --server, --key and --key-file. Their defaults come from CREASED_URL and CREASED_KEY.
void add_server_options(CLI::App& command, Server& server);

/// Adds --weights.
void add_weights_option(CLI::App& command, std::filesystem::path& weights);

}  // namespace crease::client
