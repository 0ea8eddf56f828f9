#pragma once

#include <vector>

#include "server/api/route.h"

namespace creased {

/// What the service says of itself: parameters, health, metrics, and its OpenAPI document.
std::vector<Route> service_routes();

}  // namespace creased
