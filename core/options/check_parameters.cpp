#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "core/options/parameters.h"

namespace crease {
namespace {

void require(bool fits, const Parameter& parameter, std::string_view fault) {
  if (!fits) throw std::logic_error(fmt::format("parameter {}: {}", parameter.name, fault));
}

void check_place(const Parameter& parameter, const ParameterPlace& place) {
  require(place.type == parameter.type(), parameter, "its type differs from method to method");
  const bool is_number = place.type == ParameterType::kInteger || place.type == ParameterType::kNumber;
  require(is_number == (place.min < place.max), parameter, "numbers have a range, and nothing else has");
  require(parse_value(parameter, text_of(default_value(parameter, place))) == default_value(parameter, place),
          parameter, "its default is not a value of it");
}

void check_condition(const Parameter& parameter, const ParameterCondition& condition) {
  const Parameter& other = find_parameter(condition.parameter);
  require(other.name != parameter.name, parameter, "it depends on itself");
  for (const std::string_view word : condition.words) parse_value(other, word);
}

}  // namespace

void check_parameter_table() {
  std::set<std::string_view> names;
  std::set<int> fields;
  for (const Parameter& parameter : parameter_table()) {
    require(names.insert(parameter.name).second, parameter, "the name stands twice");
    require(fields.insert(parameter.field).second, parameter, "the field number stands twice");
    require(!parameter.meaning.empty() && !parameter.group.empty(), parameter, "it has no meaning or no group");
    for (const ParameterPlace& place : parameter.places) check_place(parameter, place);
    for (const ParameterCondition& condition : parameter.conditions) check_condition(parameter, condition);
  }
}

}  // namespace crease
