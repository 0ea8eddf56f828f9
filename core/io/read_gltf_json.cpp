#include "core/io/read_gltf_json.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"

namespace crease::gltf {
namespace {

constexpr int kDeepest = 64;
constexpr std::size_t kMostValues = 500'000;

std::string byte_place(std::size_t byte) { return fmt::format("byte {}", byte); }

[[noreturn]] void fail_type(const char* name, std::string_view wanted, const std::string& place) {
  throw Error(code::kMeshSyntax, fmt::format("'{}' must be {}", name, wanted), place);
}

}  // namespace

Json parse_json(std::string_view text, std::size_t offset) {
  std::size_t values = 0;
  const auto bounded = [&](int depth, Json::parse_event_t /*event*/, Json& /*value*/) {
    if (depth > kDeepest) {
      throw Error(code::kMeshTooLarge, fmt::format("the JSON is nested more than {} levels deep", kDeepest),
                  byte_place(offset));
    }
    if (++values > kMostValues) {
      throw Error(code::kMeshTooLarge, fmt::format("the JSON has more than {} values", kMostValues),
                  byte_place(offset));
    }
    return true;
  };
  try {
    return Json::parse(text.begin(), text.end(), bounded);
  } catch (const Json::parse_error& error) {
    const bool ended = error.byte > text.size();
    throw Error(ended ? code::kMeshTruncated : code::kMeshSyntax,
                ended ? "the JSON ends too early" : "the JSON is not valid",
                byte_place(offset + std::max<std::size_t>(error.byte, 1) - 1));
  } catch (const Json::exception&) {
    throw Error(code::kMeshSyntax, "the JSON has a number that is out of the range of a double", byte_place(offset));
  }
}

const Json* find_member(const Json& object, const char* name, const std::string& place) {
  if (!object.is_object())
    throw Error(code::kMeshSyntax, fmt::format("expected an object with a member '{}'", name), place);
  const auto found = object.find(name);
  return found == object.end() ? nullptr : &*found;
}

std::size_t size_value(const Json& value, const char* name, const std::string& place) {
  if (!value.is_number_unsigned()) fail_type(name, "an integer, 0 or more", place);
  return value.get<std::size_t>();
}

std::size_t size_member(const Json& object, const char* name, const std::string& place) {
  const Json* value = find_member(object, name, place);
  if (value == nullptr) throw Error(code::kMeshSyntax, fmt::format("'{}' is missing", name), place);
  return size_value(*value, name, place);
}

std::size_t size_member_or(const Json& object, const char* name, std::size_t otherwise, const std::string& place) {
  const Json* value = find_member(object, name, place);
  return value == nullptr ? otherwise : size_value(*value, name, place);
}

const Json& array_member(const Json& object, const char* name, const std::string& place) {
  static const Json empty = Json::array();
  const Json* value = find_member(object, name, place);
  if (value == nullptr) return empty;
  if (!value->is_array()) fail_type(name, "an array", place);
  return *value;
}

bool numbers_member(const Json& object, const char* name, double* values, std::size_t count, const std::string& place) {
  const Json* array = find_member(object, name, place);
  if (array == nullptr) return false;
  if (!array->is_array() || array->size() != count) fail_type(name, fmt::format("{} numbers", count), place);
  for (std::size_t k = 0; k < count; ++k) {
    if (!(*array)[k].is_number()) fail_type(name, fmt::format("{} numbers", count), place);
    values[k] = (*array)[k].get<double>();
  }
  return true;
}

}  // namespace crease::gltf
