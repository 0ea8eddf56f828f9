#include "core/smooth/options.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <type_traits>

#include "core/error.h"

namespace crease {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

std::string text(const OptionValue& value) {
  return std::visit([](const auto& v) { return fmt::format("{}", v); }, value);
}

/// What the API calls an option, and how it is read from and written to the struct.
struct Binding {
  std::string_view name;
  void (*set)(SmoothOptions&, std::string_view name, const OptionValue&);
  OptionValue (*get)(const SmoothOptions&);
};

template <typename T>
const T& get_as(std::string_view name, const OptionValue& value) {
  if (const T* v = std::get_if<T>(&value)) return *v;
  const std::string_view expected = std::is_same_v<T, bool>            ? "true or false"
                                    : std::is_same_v<T, std::uint32_t> ? "a whole number"
                                    : std::is_same_v<T, double>        ? "a number"
                                                                       : "a word";
  throw Error::parameter(code::kParameterInvalid, std::string(name), text(value), std::string(expected));
}

template <auto Member, typename T>
Binding direct(std::string_view name) {
  return {name, [](SmoothOptions& o, std::string_view n, const OptionValue& v) { o.*Member = get_as<T>(n, v); },
          [](const SmoothOptions& o) { return OptionValue(o.*Member); }};
}

template <auto Member>
Binding degrees(std::string_view name) {
  return {
      name,
      [](SmoothOptions& o, std::string_view n, const OptionValue& v) { o.*Member = get_as<double>(n, v) * kDegree; },
      [](const SmoothOptions& o) { return OptionValue(o.*Member / kDegree); }};
}

void require_word(std::string_view name, const OptionValue& value, std::string_view only) {
  if (get_as<std::string>(name, value) != only) {
    throw Error::parameter(code::kParameterInvalid, std::string(name), text(value), std::string(only));
  }
}

void set_smoothness(SmoothOptions& options, std::string_view name, const OptionValue& value) {
  const auto& word = get_as<std::string>(name, value);
  if (word == "quadratic") {
    options.smoothness = Smoothness::kQuadratic;
  } else if (word == "square_root") {
    options.smoothness = Smoothness::kSquareRoot;
  } else {
    throw Error::parameter(code::kParameterInvalid, std::string(name), word, "quadratic or square_root");
  }
}

OptionValue get_smoothness(const SmoothOptions& options) {
  return std::string(options.smoothness == Smoothness::kQuadratic ? "quadratic" : "square_root");
}

/// A choice of the API with one member so far.
template <char const* Word>
Binding only_choice(std::string_view name) {
  return {name, [](SmoothOptions&, std::string_view n, const OptionValue& v) { require_word(n, v, Word); },
          [](const SmoothOptions&) { return OptionValue(std::string(Word)); }};
}

constexpr char kMrf[] = "mrf", kVertex[] = "vertex", kMetropolis[] = "metropolis", kQuadraticWord[] = "quadratic";

const std::vector<Binding>& bindings() {
  using O = SmoothOptions;
  static const std::vector<Binding> table{
      only_choice<kMrf>("method"),
      only_choice<kVertex>("process"),
      only_choice<kMetropolis>("solver"),
      direct<&O::sweeps, std::uint32_t>("sweeps"),
      direct<&O::seed, std::uint32_t>("seed"),
      direct<&O::threads, std::uint32_t>("threads"),
      only_choice<kQuadraticWord>("likelihood"),
      direct<&O::likelihood_weight, double>("likelihood_weight"),
      direct<&O::likelihood_weight_start, double>("likelihood_weight_start"),
      {"smoothness", set_smoothness, get_smoothness},
      direct<&O::smoothness_weight, double>("smoothness_weight"),
      direct<&O::edge_process, bool>("edge_process"),
      degrees<&O::sharpness_threshold>("sharpness_threshold_deg"),
      direct<&O::sharpness_weight, double>("sharpness_weight"),
      direct<&O::support_weight, double>("support_weight"),
      direct<&O::label_temperature_start, double>("label_temperature_start"),
      direct<&O::label_temperature_end, double>("label_temperature_end"),
      direct<&O::vertex_temperature_start, double>("vertex_temperature_start"),
      direct<&O::vertex_temperature_end, double>("vertex_temperature_end"),
      direct<&O::step_size, double>("step_size"),
  };
  return table;
}

}  // namespace

void set_option(SmoothOptions& options, std::string_view name, const OptionValue& value) {
  const auto binding = std::ranges::find(bindings(), name, &Binding::name);
  if (binding == bindings().end()) {
    throw Error::parameter(code::kParameterUnknown, std::string(name), text(value), "the name of a parameter");
  }
  binding->set(options, name, value);
}

std::vector<std::pair<std::string, OptionValue>> option_values(const SmoothOptions& options) {
  std::vector<std::pair<std::string, OptionValue>> values;
  for (const Binding& binding : bindings()) values.emplace_back(binding.name, binding.get(options));
  return values;
}

}  // namespace crease
