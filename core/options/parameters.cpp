#include "core/options/parameters.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

namespace crease {
namespace {

/// How much of a value that was far too long an error repeats.
constexpr std::size_t kMaxEcho = 100;

[[noreturn]] void refuse(ErrorCode code, const Parameter& parameter, std::string_view value) {
  throw Error::parameter(code, std::string(parameter.name), shortened(value), parameter.expected());
}

std::optional<double> number_in(const ParameterValue& value) {
  if (const auto* number = std::get_if<double>(&value)) return *number;
  if (const auto* integer = std::get_if<std::uint32_t>(&value)) return *integer;
  return std::nullopt;
}

/// The whole text as a number of type T, or a refusal.
template <typename T>
T parse_number(const Parameter& parameter, std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size() || error == std::errc::invalid_argument) {
    refuse(code::kParameterInvalid, parameter, text);
  }
  if (error != std::errc()) refuse(code::kParameterOutOfRange, parameter, text);
  return value;
}

void check_range(const Parameter& parameter, double value, std::string_view text) {
  if (!std::isfinite(value)) refuse(code::kParameterInvalid, parameter, text);
  if (value < parameter.min() || value > parameter.max()) refuse(code::kParameterOutOfRange, parameter, text);
}

void check_word(const Parameter& parameter, std::string_view word) {
  const auto words = parameter.words();
  if (std::ranges::find(words, word) == words.end()) refuse(code::kParameterInvalid, parameter, word);
}

/// What one method does not take, though others do.
void check_for_method(const Parameter& parameter, const ParameterPlace& place, const ParameterValue& value) {
  const auto number = number_in(value);
  if (!number || (*number >= place.min && *number <= place.max)) return;
  throw Error::parameter(code::kParameterOutOfRange, std::string(parameter.name), text_of(value),
                         fmt::format("{} with method={}", range_text(place), method_names().at(*place.method)));
}

bool matters(const Parameter& parameter, const JobOptions& options);

bool holds(const ParameterCondition& condition, const JobOptions& options) {
  const Parameter& other = find_parameter(condition.parameter);
  if (!matters(other, options)) return false;
  const std::string word = text_of(other.place_for(options.smooth.method.index())->get(options));
  return std::ranges::find(condition.words, word) != condition.words.end();
}

bool matters(const Parameter& parameter, const JobOptions& options) {
  return parameter.place_for(options.smooth.method.index()) != nullptr &&
         std::ranges::all_of(parameter.conditions, [&](const auto& one) { return holds(one, options); });
}

/// The given value with what an automatic one stands for in its place.
ParameterValue chosen(const Parameter& parameter, const ParameterPlace& place, const ParameterValue& value,
                      const ParameterValues& given) {
  if (parameter.automatic.text.empty() || text_of(value) != parameter.automatic.text) return value;
  return parameter.automatic.choose != nullptr ? parameter.automatic.choose(given) : default_value(parameter, place);
}

/// Sets what was given of the parameters that the method has. The method comes first in the table, and with it the
/// options that the others are set in.
JobOptions options_of(const ParameterValues& given) {
  JobOptions options;
  for (const Parameter& parameter : parameter_table()) {
    const auto value = given.find(parameter.name);
    const ParameterPlace* place = parameter.place_for(options.smooth.method.index());
    if (place == nullptr) continue;
    if (value != given.end()) place->set(options, chosen(parameter, *place, value->second, given));
    // A word that was left out may still depend on what was given.
    if (value == given.end() && parameter.type() == ParameterType::kWord && parameter.automatic.choose != nullptr) {
      place->set(options, parameter.automatic.choose(given));
    }
  }
  return options;
}

std::string not_used(const Parameter& parameter, const ParameterValue& value) {
  return fmt::format("parameter '{}' is '{}' and is not used: it matters only with {}", parameter.name, text_of(value),
                     text_of(conditions_of(parameter)));
}

}  // namespace

std::string shortened(std::string_view text) {
  return text.size() <= kMaxEcho ? std::string(text) : std::string(text.substr(0, kMaxEcho)) + "…";
}

double Parameter::min() const { return std::ranges::min(places, {}, &ParameterPlace::min).min; }

double Parameter::max() const { return std::ranges::max(places, {}, &ParameterPlace::max).max; }

std::vector<std::string_view> Parameter::words() const {
  std::vector<std::string_view> all;
  if (type() == ParameterType::kWord && !automatic.text.empty()) all.push_back(automatic.text);
  all.insert(all.end(), places.front().words.begin(), places.front().words.end());
  return all;
}

std::string Parameter::expected() const {
  if (type() == ParameterType::kBoolean) return "true or false";
  if (type() == ParameterType::kWord) return fmt::format("one of {}", fmt::join(words(), ", "));
  return range_text({.type = type(), .min = min(), .max = max()});
}

std::optional<ParameterValue> Parameter::common_default() const {
  const ParameterValue first = default_value(*this, places.front());
  const auto agrees = [&](const ParameterPlace& place) { return default_value(*this, place) == first; };
  return std::ranges::all_of(places, agrees) ? std::optional(first) : std::nullopt;
}

bool Parameter::has_common_range() const {
  return std::ranges::all_of(places, [&](const auto& place) { return place.min == min() && place.max == max(); });
}

const ParameterPlace* Parameter::place_for(std::size_t method) const {
  const auto place =
      std::ranges::find_if(places, [&](const auto& one) { return !one.method || *one.method == method; });
  return place == places.end() ? nullptr : &*place;
}

const Parameter& find_parameter(std::string_view name, std::string_view value) {
  const auto& table = parameter_table();
  const auto found = std::ranges::find(table, name, &Parameter::name);
  if (found != table.end()) return *found;
  std::vector<std::string_view> names;
  for (const Parameter& parameter : table) names.push_back(parameter.name);
  throw Error::parameter(code::kParameterUnknown, shortened(name), shortened(value),
                         fmt::format("one of {}", fmt::join(names, ", ")));
}

ParameterValue default_value(const Parameter& parameter, const ParameterPlace& place) {
  JobOptions options;
  if (place.method) options.smooth.method = default_method(*place.method);
  return parameter.place_for(options.smooth.method.index())->get(options);
}

const std::vector<std::string_view>& method_names() {
  static const std::vector<std::string_view> names = [] {
    std::vector<std::string_view> all;
    for (std::size_t i = 0; i < std::variant_size_v<Method>; ++i) {
      all.push_back(std::visit([](const auto& options) { return options.kName; }, default_method(i)));
    }
    return all;
  }();
  return names;
}

std::string text_of(const ParameterValue& value) {
  return std::visit([](const auto& v) { return fmt::format("{}", v); }, value);
}

std::vector<ParameterCondition> conditions_of(const Parameter& parameter) {
  ParameterCondition methods{"method", {}};
  for (const ParameterPlace& place : parameter.places) {
    if (place.method) methods.words.push_back(method_names().at(*place.method));
  }
  std::vector<ParameterCondition> all;
  if (!methods.words.empty()) all.push_back(std::move(methods));
  all.insert(all.end(), parameter.conditions.begin(), parameter.conditions.end());
  return all;
}

std::string text_of(const std::vector<ParameterCondition>& conditions) {
  std::string text;
  for (const ParameterCondition& condition : conditions) {
    text += fmt::format("{}{}={}", text.empty() ? "" : ", ", condition.parameter, fmt::join(condition.words, " or "));
  }
  return text;
}

std::string range_text(const ParameterPlace& place) {
  const std::string_view kind = place.type == ParameterType::kInteger ? "whole number" : "number";
  return fmt::format("a {} from {} to {}", kind, place.min, place.max);
}

ParameterValue parse_value(const Parameter& parameter, std::string_view text) {
  switch (parameter.type()) {
    case ParameterType::kBoolean:
      if (text != "true" && text != "false") refuse(code::kParameterInvalid, parameter, text);
      return text == "true";
    case ParameterType::kInteger: {
      const auto value = parse_number<std::int64_t>(parameter, text);
      check_range(parameter, static_cast<double>(value), text);
      return static_cast<std::uint32_t>(value);
    }
    case ParameterType::kNumber: {
      const auto value = parse_number<double>(parameter, text);
      check_range(parameter, value, text);
      return value;
    }
    case ParameterType::kWord:
      break;
  }
  check_word(parameter, text);
  return std::string(text);
}

void check_value(const Parameter& parameter, const ParameterValue& value) {
  const std::string text = text_of(value);
  if (const auto number = number_in(value)) check_range(parameter, *number, text);
  if (parameter.type() == ParameterType::kWord) check_word(parameter, text);
}

ResolvedParameters resolve_parameters(const ParameterValues& given) {
  for (const auto& [name, value] : given) check_value(find_parameter(name), value);
  const JobOptions wanted = options_of(given);
  const std::size_t method = wanted.smooth.method.index();
  ResolvedParameters resolved;
  for (const Parameter& parameter : parameter_table()) {
    const auto value = given.find(parameter.name);
    if (matters(parameter, wanted)) {
      const ParameterPlace& place = *parameter.place_for(method);
      const ParameterValue settled = value != given.end() ? chosen(parameter, place, value->second, given)
                                     : parameter.type() == ParameterType::kWord
                                         ? place.get(wanted)
                                         : chosen(parameter, place, default_value(parameter, place), given);
      check_for_method(parameter, place, settled);
      resolved.values.emplace(parameter.name, settled);
    } else if (value != given.end()) {
      resolved.warnings.push_back({"parameter_not_used", not_used(parameter, value->second)});
    }
  }
  resolved.options = options_of(resolved.values);
  return resolved;
}

ParameterValues values_of(const JobOptions& options) {
  ParameterValues values;
  for (const Parameter& parameter : parameter_table()) {
    if (!matters(parameter, options)) continue;
    values.emplace(parameter.name, parameter.place_for(options.smooth.method.index())->get(options));
  }
  return values;
}

}  // namespace crease
