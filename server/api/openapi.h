#pragma once

#include <nlohmann/json.hpp>

#include "proto/parameter_table.h"

namespace creased {

/// The OpenAPI 3.1 document of the API, made from the tables of routes, parameters and errors and from the protobuf
/// schema.
nlohmann::ordered_json openapi_document(const crease::OperatorSettings& settings);

}  // namespace creased
