#pragma once

#include <vector>

#include "server/api/route.h"

namespace creased {

/// Meshes to try the service with.
std::vector<Route> sample_routes();

}  // namespace creased
