#pragma once

#include <nlohmann/json.hpp>

namespace creased {

/// The OpenAPI 3.1 description of the API, made from the tables of routes, parameters and errors and from the schema.
const nlohmann::ordered_json& openapi_document();

}  // namespace creased
