#pragma once

#include <nlohmann/json.hpp>

namespace creased {

/// The OpenAPI 3.1 document of the API, made from the tables of routes, parameters and errors and from the protobuf
/// schema.
const nlohmann::ordered_json& openapi_document();

}  // namespace creased
