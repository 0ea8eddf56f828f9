#include "proto/parameter_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <thread>

#include "core/error.h"

namespace crease {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Reflection;

// What an error repeats of a value that was far too long.
constexpr std::size_t kMaxEcho = 100;

std::string shortened(std::string_view text) {
  return text.size() <= kMaxEcho ? std::string(text) : std::string(text.substr(0, kMaxEcho)) + "…";
}

ParameterType type_of(const FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_BOOL:
      return ParameterType::kBoolean;
    case FieldDescriptor::CPPTYPE_UINT32:
      return ParameterType::kInteger;
    case FieldDescriptor::CPPTYPE_STRING:
      return ParameterType::kString;
    default:
      return ParameterType::kNumber;
  }
}

ParameterInfo info_of(const FieldDescriptor& field) {
  const v1::ParameterSpec& spec = field.options().GetExtension(v1::parameter);
  return {.name = field.name(),
          .type = type_of(field),
          .unit = spec.unit(),
          .min = spec.min(),
          .max = spec.max(),
          .values = {spec.values().begin(), spec.values().end()},
          .default_text = spec.default_(),
          .meaning = spec.meaning()};
}

const ParameterInfo& find_info(std::string_view name, std::string_view value) {
  const auto& table = parameter_table();
  const auto info = std::ranges::find(table, name, &ParameterInfo::name);
  if (info == table.end()) {
    throw Error::parameter(code::kParameterUnknown, shortened(name), shortened(value),
                           fmt::format("one of {}", fmt::join(parameter_names(), ", ")));
  }
  return *info;
}

[[noreturn]] void refuse(std::string_view code, const ParameterInfo& info, std::string_view value) {
  throw Error::parameter(code, info.name, shortened(value), info.expected());
}

/// The whole text as a number of type T, or a refusal.
template <typename T>
T parse(const ParameterInfo& info, std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size() || error == std::errc::invalid_argument) {
    refuse(code::kParameterInvalid, info, text);
  }
  if (error != std::errc()) refuse(code::kParameterOutOfRange, info, text);
  return value;
}

void check_range(const ParameterInfo& info, double value, std::string_view text) {
  if (!std::isfinite(value)) refuse(code::kParameterInvalid, info, text);
  if (value < info.min || value > info.max) refuse(code::kParameterOutOfRange, info, text);
}

void check_word(const ParameterInfo& info, std::string_view word) {
  if (std::ranges::find(info.values, word) == info.values.end()) refuse(code::kParameterInvalid, info, word);
}

OptionValue parse_value(const ParameterInfo& info, std::string_view text) {
  switch (info.type) {
    case ParameterType::kBoolean:
      if (text != "true" && text != "false") refuse(code::kParameterInvalid, info, text);
      return text == "true";
    case ParameterType::kInteger: {
      const auto value = parse<std::int64_t>(info, text);
      check_range(info, static_cast<double>(value), text);
      return static_cast<std::uint32_t>(value);
    }
    case ParameterType::kNumber: {
      const auto value = parse<double>(info, text);
      check_range(info, value, text);
      return value;
    }
    case ParameterType::kString:
      break;
  }
  check_word(info, text);
  return std::string(text);
}

const FieldDescriptor& field_of(const std::string& name) {
  return *v1::Parameters::descriptor()->FindFieldByName(name);
}

/// The value of a field that is set.
OptionValue value_of(const v1::Parameters& parameters, const ParameterInfo& info) {
  const Reflection& reflection = *v1::Parameters::GetReflection();
  const FieldDescriptor& field = field_of(info.name);
  switch (info.type) {
    case ParameterType::kBoolean:
      return reflection.GetBool(parameters, &field);
    case ParameterType::kInteger:
      return reflection.GetUInt32(parameters, &field);
    case ParameterType::kNumber:
      return reflection.GetDouble(parameters, &field);
    case ParameterType::kString:
      break;
  }
  return reflection.GetString(parameters, &field);
}

bool is_set(const v1::Parameters& parameters, const ParameterInfo& info) {
  return v1::Parameters::GetReflection()->HasField(parameters, &field_of(info.name));
}

void set_value(v1::Parameters& parameters, const ParameterInfo& info, const OptionValue& value) {
  const Reflection& reflection = *v1::Parameters::GetReflection();
  const FieldDescriptor& field = field_of(info.name);
  switch (info.type) {
    case ParameterType::kBoolean:
      return reflection.SetBool(&parameters, &field, std::get<bool>(value));
    case ParameterType::kInteger:
      return reflection.SetUInt32(&parameters, &field, std::get<std::uint32_t>(value));
    case ParameterType::kNumber:
      return reflection.SetDouble(&parameters, &field, std::get<double>(value));
    case ParameterType::kString:
      return reflection.SetString(&parameters, &field, std::get<std::string>(value));
  }
}

bool has_json_type(const ParameterInfo& info, const nlohmann::json& value) {
  switch (info.type) {
    case ParameterType::kBoolean:
      return value.is_boolean();
    case ParameterType::kInteger:
      return value.is_number_integer();
    case ParameterType::kNumber:
      return value.is_number();
    case ParameterType::kString:
      break;
  }
  return value.is_string();
}

/// What no single range can say. λ of Taubin's filter amplifies every frequency beyond this [Taubin 1995].
void check_together(const v1::Parameters& resolved) {
  constexpr double kLargestTaubinStep = 0.65;
  if (resolved.method() == "taubin" && resolved.flow_step() > kLargestTaubinStep) {
    throw Error::parameter(code::kParameterOutOfRange, "flow_step", fmt::format("{}", resolved.flow_step()),
                           fmt::format("a number from 0 to {} with method=taubin", kLargestTaubinStep));
  }
}

nlohmann::ordered_json to_json(const OptionValue& value) {
  return std::visit([](const auto& v) { return nlohmann::ordered_json(v); }, value);
}

nlohmann::ordered_json property_schema(const ParameterInfo& info) {
  nlohmann::ordered_json schema;
  switch (info.type) {
    case ParameterType::kBoolean:
      schema["type"] = "boolean";
      break;
    case ParameterType::kInteger:
      schema["type"] = "integer";
      schema["minimum"] = static_cast<std::int64_t>(info.min);
      schema["maximum"] = static_cast<std::int64_t>(info.max);
      break;
    case ParameterType::kNumber:
      schema["type"] = "number";
      schema["minimum"] = info.min;
      schema["maximum"] = info.max;
      break;
    case ParameterType::kString:
      schema["type"] = "string";
      schema["enum"] = info.values;
      break;
  }
  schema["default"] = to_json(parse_value(info, info.default_text));
  schema["description"] = info.meaning;
  if (!info.unit.empty()) schema["x-unit"] = info.unit;
  return schema;
}

}  // namespace

std::string ParameterInfo::expected() const {
  switch (type) {
    case ParameterType::kBoolean:
      return "true or false";
    case ParameterType::kInteger:
      return fmt::format("a whole number from {} to {}", min, max);
    case ParameterType::kNumber:
      return fmt::format("a number from {} to {}", min, max);
    case ParameterType::kString:
      break;
  }
  return values.size() == 1 ? values.front() : fmt::format("one of {}", fmt::join(values, ", "));
}

const std::vector<ParameterInfo>& parameter_table() {
  static const std::vector<ParameterInfo> table = [] {
    const auto* descriptor = v1::Parameters::descriptor();
    std::vector<ParameterInfo> rows;
    for (int i = 0; i < descriptor->field_count(); ++i) rows.push_back(info_of(*descriptor->field(i)));
    return rows;
  }();
  return table;
}

std::vector<std::string> parameter_names() {
  std::vector<std::string> names;
  names.reserve(parameter_table().size());
  for (const ParameterInfo& info : parameter_table()) names.push_back(info.name);
  return names;
}

void set_parameter(v1::Parameters& parameters, std::string_view name, std::string_view text) {
  const ParameterInfo& info = find_info(name, text);
  set_value(parameters, info, parse_value(info, text));
}

v1::Parameters parameters_from_json(const nlohmann::json& object) {
  if (!object.is_object()) {
    throw Error::parameter(code::kParameterInvalid, "parameters", shortened(object.dump()), "a JSON object");
  }
  v1::Parameters parameters;
  for (const auto& [name, value] : object.items()) {
    const ParameterInfo& info = find_info(name, value.dump());
    if (!has_json_type(info, value)) refuse(code::kParameterInvalid, info, value.dump());
    set_parameter(parameters, name, value.is_string() ? value.get<std::string>() : value.dump());
  }
  return parameters;
}

void validate(const v1::Parameters& parameters) {
  const auto& unknown = v1::Parameters::GetReflection()->GetUnknownFields(parameters);
  if (!unknown.empty()) {
    throw Error::parameter(code::kParameterUnknown, fmt::format("field {}", unknown.field(0).number()), "",
                           "fields of crease.v1.Parameters");
  }
  for (const ParameterInfo& info : parameter_table()) {
    if (!is_set(parameters, info)) continue;
    const OptionValue value = value_of(parameters, info);
    const std::string text = std::visit([](const auto& v) { return fmt::format("{}", v); }, value);
    if (const auto* number = std::get_if<double>(&value)) check_range(info, *number, text);
    if (const auto* integer = std::get_if<std::uint32_t>(&value)) check_range(info, *integer, text);
    if (const auto* word = std::get_if<std::string>(&value)) check_word(info, *word);
  }
}

v1::Parameters resolve(const v1::Parameters& parameters) {
  v1::Parameters resolved = parameters;
  for (const ParameterInfo& info : parameter_table()) {
    if (!is_set(resolved, info)) set_parameter(resolved, info.name, info.default_text);
  }
  check_together(resolved);
  if (resolved.process() == "auto") resolved.set_process("both");
  if (resolved.solver() == "auto") resolved.set_solver("metropolis");
  if (resolved.threads() == 0) resolved.set_threads(std::max(1U, std::thread::hardware_concurrency()));
  return resolved;
}

SmoothOptions to_options(const v1::Parameters& resolved) {
  SmoothOptions options;
  for (const ParameterInfo& info : parameter_table()) {
    if (!is_of_service(info.name)) set_option(options, info.name, value_of(resolved, info));
  }
  return options;
}

nlohmann::ordered_json parameters_schema() {
  nlohmann::ordered_json properties;
  for (const ParameterInfo& info : parameter_table()) properties[info.name] = property_schema(info);
  return {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
          {"title", "Parameters of a job"},
          {"type", "object"},
          {"properties", std::move(properties)},
          {"additionalProperties", false}};
}

bool is_of_service(std::string_view name) { return name == "retention_hours"; }

bool changes_result(std::string_view name) { return name != "threads" && !is_of_service(name); }

}  // namespace crease
