#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>

#include "client/cli/console.h"

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

/// --server, from CREASED_URL when it is not given.
CLI::Option* add_server_option(CLI::App& command, std::string& server);

/// --weights
void add_weights_option(CLI::App& command, std::filesystem::path& weights);

}  // namespace crease::client
