#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace crease::gltf {

using Json = nlohmann::json;

/// Parses untrusted JSON; its nesting and its number of values are bounded. `offset` is where it starts in the file.
/// \throw Error mesh_syntax, mesh_truncated, mesh_too_large with the place "byte N"
Json parse_json(std::string_view text, std::size_t offset);

/// A member of `object`, or null where it has none. `place` names the object in the error that it is none.
const Json* find_member(const Json& object, const char* name, const std::string& place);

/// A whole number that is not negative. \throw Error mesh_syntax when it is missing or something else
std::size_t size_member(const Json& object, const char* name, const std::string& place);
std::size_t size_member_or(const Json& object, const char* name, std::size_t otherwise, const std::string& place);

/// A member that is an array, empty where there is none. \throw Error mesh_syntax when it is something else
const Json& array_member(const Json& object, const char* name, const std::string& place);

/// A whole number that is not negative. \throw Error mesh_syntax
std::size_t size_value(const Json& value, const char* name, const std::string& place);

/// An array of exactly `count` numbers into `values`; false where there is none. \throw Error mesh_syntax
bool numbers_member(const Json& object, const char* name, double* values, std::size_t count, const std::string& place);

}  // namespace crease::gltf
