#include "proto/parameter_table.h"

#include <fmt/format.h>

#include <string>
#include <utility>

#include "core/error.h"

namespace crease {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Reflection;
using Json = nlohmann::ordered_json;

const FieldDescriptor& field_of(const Parameter& parameter) {
  return *v1::Parameters::descriptor()->FindFieldByNumber(parameter.field);
}

bool is_set(const v1::Parameters& parameters, const Parameter& parameter) {
  return v1::Parameters::GetReflection()->HasField(parameters, &field_of(parameter));
}

ParameterValue value_of(const v1::Parameters& parameters, const Parameter& parameter) {
  const Reflection& reflection = *v1::Parameters::GetReflection();
  const FieldDescriptor& field = field_of(parameter);
  switch (parameter.type()) {
    case ParameterType::kBoolean:
      return reflection.GetBool(parameters, &field);
    case ParameterType::kInteger:
      return reflection.GetUInt32(parameters, &field);
    case ParameterType::kNumber:
      return reflection.GetDouble(parameters, &field);
    case ParameterType::kWord:
      break;
  }
  return reflection.GetString(parameters, &field);
}

void set_value(v1::Parameters& parameters, const Parameter& parameter, const ParameterValue& value) {
  const Reflection& reflection = *v1::Parameters::GetReflection();
  const FieldDescriptor& field = field_of(parameter);
  switch (parameter.type()) {
    case ParameterType::kBoolean:
      return reflection.SetBool(&parameters, &field, std::get<bool>(value));
    case ParameterType::kInteger:
      return reflection.SetUInt32(&parameters, &field, std::get<std::uint32_t>(value));
    case ParameterType::kNumber:
      return reflection.SetDouble(&parameters, &field, std::get<double>(value));
    case ParameterType::kWord:
      return reflection.SetString(&parameters, &field, std::get<std::string>(value));
  }
}

ParameterValues values_of(const v1::Parameters& parameters) {
  ParameterValues values;
  for (const Parameter& parameter : parameter_table()) {
    if (is_set(parameters, parameter)) values.emplace(parameter.name, value_of(parameters, parameter));
  }
  return values;
}

bool has_json_type(const Parameter& parameter, const nlohmann::json& value) {
  switch (parameter.type()) {
    case ParameterType::kBoolean:
      return value.is_boolean();
    case ParameterType::kInteger:
      return value.is_number_integer();
    case ParameterType::kNumber:
      return value.is_number();
    case ParameterType::kWord:
      break;
  }
  return value.is_string();
}

Json to_json(const ParameterValue& value) {
  return std::visit([](const auto& v) { return Json(v); }, value);
}

/// A bound as a number of the parameter's type.
Json bound(const Parameter& parameter, double value) {
  return parameter.type() == ParameterType::kInteger ? Json(static_cast<std::int64_t>(value)) : Json(value);
}

Json type_schema(const Parameter& parameter) {
  switch (parameter.type()) {
    case ParameterType::kBoolean:
      return {{"type", "boolean"}};
    case ParameterType::kWord:
      return {{"type", "string"}, {"enum", parameter.words()}};
    case ParameterType::kInteger:
    case ParameterType::kNumber:
      break;
  }
  return {{"type", parameter.type() == ParameterType::kInteger ? "integer" : "number"},
          {"minimum", bound(parameter, parameter.min())},
          {"maximum", bound(parameter, parameter.max())}};
}

/// One default where all methods agree, otherwise one for each; the same for ranges.
void add_what_differs(const Parameter& parameter, Json& schema) {
  const auto common = parameter.common_default();
  if (common) schema["default"] = to_json(*common);
  for (const ParameterPlace& place : parameter.places) {
    if (!place.method) continue;
    const std::string method(method_names().at(*place.method));
    if (!common) schema["x-defaults"][method] = to_json(default_value(parameter, place));
    if (!parameter.has_common_range()) {
      schema["x-ranges"][method] = {{"minimum", bound(parameter, place.min)}, {"maximum", bound(parameter, place.max)}};
    }
  }
}

Json property_schema(const Parameter& parameter) {
  Json schema = type_schema(parameter);
  add_what_differs(parameter, schema);
  schema["description"] = parameter.meaning;
  schema["x-group"] = parameter.group;
  if (!parameter.unit.empty()) schema["x-unit"] = parameter.unit;
  for (const ParameterCondition& condition : conditions_of(parameter)) {
    schema["x-applies"][std::string(condition.parameter)] = condition.words;
  }
  return schema;
}

}  // namespace

void set_parameter(v1::Parameters& parameters, std::string_view name, std::string_view text) {
  const Parameter& parameter = find_parameter(name, text);
  set_value(parameters, parameter, parse_value(parameter, text));
}

v1::Parameters parameters_from_json(const nlohmann::json& object) {
  if (!object.is_object()) {
    throw Error::parameter(code::kParameterInvalid, "parameters", shortened(object.dump()), "a JSON object");
  }
  v1::Parameters parameters;
  for (const auto& [name, value] : object.items()) {
    const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
    const Parameter& parameter = find_parameter(name, value.dump());
    if (!has_json_type(parameter, value)) {
      throw Error::parameter(code::kParameterInvalid, name, shortened(value.dump()), parameter.expected());
    }
    set_value(parameters, parameter, parse_value(parameter, text));
  }
  return parameters;
}

void validate(const v1::Parameters& parameters) {
  const auto& unknown = v1::Parameters::GetReflection()->GetUnknownFields(parameters);
  if (!unknown.empty()) {
    throw Error::parameter(code::kParameterUnknown, fmt::format("field {}", unknown.field(0).number()), "",
                           "fields of crease.v1.Parameters");
  }
  for (const Parameter& parameter : parameter_table()) {
    if (is_set(parameters, parameter)) check_value(parameter, value_of(parameters, parameter));
  }
}

v1::Parameters resolve(const v1::Parameters& given, std::vector<Warning>* warnings) {
  ResolvedParameters resolved = resolve_parameters(values_of(given));
  v1::Parameters message;
  for (const auto& [name, value] : resolved.values) set_value(message, find_parameter(name), value);
  if (warnings != nullptr) {
    warnings->insert(warnings->end(), resolved.warnings.begin(), resolved.warnings.end());
  }
  return message;
}

SmoothOptions to_options(const v1::Parameters& parameters) {
  return resolve_parameters(values_of(parameters)).options.smooth;
}

nlohmann::ordered_json parameters_schema(const OperatorSettings& settings) {
  Json properties;
  for (const Parameter& parameter : parameter_table()) {
    Json& schema = properties[std::string(parameter.name)] = property_schema(parameter);
    if (is_set(settings.defaults, parameter)) schema["default"] = to_json(value_of(settings.defaults, parameter));
    if (is_set(settings.maxima, parameter)) schema["maximum"] = to_json(value_of(settings.maxima, parameter));
  }
  return {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
          {"title", "Parameters of a job"},
          {"type", "object"},
          {"properties", std::move(properties)},
          {"additionalProperties", false}};
}

}  // namespace crease
