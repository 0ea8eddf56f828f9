#pragma once

#include <filesystem>

#include "server/config.h"

namespace creased {

/// Runs the service until SIGTERM or SIGINT, then drains it. SIGHUP reloads the keys. These signals must be blocked in
/// all threads. Returns the exit code: 0 after a drain, 1 when the service could not start.
int serve(const ServeConfig& config, const std::filesystem::path& executable);

}  // namespace creased
