#pragma once

#include <vector>

#include "server/api/route.h"

namespace creased {

/// The web page.
std::vector<Route> page_routes();

}  // namespace creased
