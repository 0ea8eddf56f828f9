#pragma once

#include <vector>

#include "server/api/route.h"

namespace creased {

/// GET /v1/jobs/{id}/events sends `progress` events, then `succeeded`, `failed` or `cancelled` with the job. The id of
/// an event is the version of the job. A stream ends when its key is revoked.
std::vector<Route> event_routes();

}  // namespace creased
