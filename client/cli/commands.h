#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>

#include "client/cli/console.h"
#include "client/cli/service_client.h"

namespace crease::client {

/// smooth
void add_smooth_command(CLI::App& app, Run& run);
/// submit, status, watch, cancel, list, delete
void add_job_commands(CLI::App& app, Run& run);
/// mesh, labels, ridges, report
void add_result_commands(CLI::App& app, Run& run);
/// noise, measure
void add_mesh_commands(CLI::App& app, Run& run);
/// parameters, health
void add_service_commands(CLI::App& app, Run& run);

inline constexpr const char* kDefaultServer = "http://127.0.0.1:8080";

/// --server, --key and --key-file, from CREASED_URL and CREASED_KEY when they are not given.
void add_server_options(CLI::App& command, Server& server);

/// --weights
void add_weights_option(CLI::App& command, std::filesystem::path& weights);

}  // namespace crease::client
