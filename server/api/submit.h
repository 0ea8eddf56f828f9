#pragma once

#include <vector>

#include "server/api/route.h"

namespace creased {

/// POST /v1/jobs receives the upload, inspects it, submits the job, and waits for its end when Prefer asks for it.
std::vector<Route> submit_routes();

}  // namespace creased
