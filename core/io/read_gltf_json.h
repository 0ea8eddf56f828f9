#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace crease::gltf {

using Json = nlohmann::json;

/// Parses untrusted JSON with limits on its nesting and its number of values. `offset` is where it starts in the file.
/// \throw Error mesh_syntax, mesh_truncated, mesh_too_large with the place "byte N"
Json parse_json(std::string_view text, std::size_t offset);

/// A member of `object`, or null if there is none. \throw Error mesh_syntax with `place` if it is not an object
const Json* find_member(const Json& object, const char* name, const std::string& place);

/// A member that is an integer, 0 or more. \throw Error mesh_syntax if it is missing or anything else
std::size_t size_member(const Json& object, const char* name, const std::string& place);
std::size_t size_member_or(const Json& object, const char* name, std::size_t otherwise, const std::string& place);

/// A member that is an array; empty if there is none. \throw Error mesh_syntax if it is anything else
const Json& array_member(const Json& object, const char* name, const std::string& place);

/// The value as an integer, 0 or more. \throw Error mesh_syntax
std::size_t size_value(const Json& value, const char* name, const std::string& place);

/// Reads an array of exactly `count` numbers into `values`. Returns false if there is none. \throw Error mesh_syntax
bool numbers_member(const Json& object, const char* name, double* values, std::size_t count, const std::string& place);

}  // namespace crease::gltf
