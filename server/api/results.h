#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "server/api/route.h"

namespace creased {

/// The results of a job: mesh, labels, ridge lines and report.
std::vector<Route> result_routes();

/// What /labels and /ridges answer as JSON. In JSON, edges are pairs; in the protobuf message they are a flat list.
nlohmann::ordered_json labels_schema();
nlohmann::ordered_json ridge_lines_schema();

}  // namespace creased
