#pragma once

#include <filesystem>

#include "server/config.h"

namespace creased {

/// Runs the service until SIGTERM or SIGINT, then drains. SIGHUP reads the keys again.
/// These signals must be blocked in all threads.
/// Returns the exit code: 0 after a drain, 1 when it could not start or listen.
int serve(const ServeConfig& config, const std::filesystem::path& executable);

}  // namespace creased
