#include "core/smooth/options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <type_traits>
#include <utility>

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

template <auto Member>
Binding classical(std::string_view name) {
  using T = std::decay_t<decltype(std::declval<ClassicalOptions>().*Member)>;
  return {name,
          [](SmoothOptions& o, std::string_view n, const OptionValue& v) { o.classical.*Member = get_as<T>(n, v); },
          [](const SmoothOptions& o) { return OptionValue(o.classical.*Member); }};
}

template <Eigen::Index kAxis>
Binding scan_axis(std::string_view name) {
  return {name,
          [](SmoothOptions& o, std::string_view n, const OptionValue& v) {
            o.scan_direction[kAxis] = get_as<double>(n, v);
          },
          [](const SmoothOptions& o) { return OptionValue(o.scan_direction[kAxis]); }};
}

/// The words of an enumeration, in the order of its values.
template <typename Enum>
struct Words;
template <>
struct Words<Process> {
  static constexpr std::array<std::string_view, 3> kAll{"vertex", "face", "both"};
};
template <>
struct Words<Solver> {
  static constexpr std::array<std::string_view, 2> kAll{"metropolis", "mean_field"};
};
template <>
struct Words<LikelihoodKind> {
  static constexpr std::array<std::string_view, 4> kAll{"quadratic", "huber", "anisotropic", "volume"};
};
template <>
struct Words<Smoothness> {
  static constexpr std::array<std::string_view, 4> kAll{"quadratic", "square_root", "huber", "truncated"};
};
template <>
struct Words<RidgeKind> {
  static constexpr std::array<std::string_view, 3> kAll{"all", "convex", "concave"};
};
template <>
struct Words<ClassicalMethod> {
  static constexpr std::array<std::string_view, 8> kAll{
      "fuzzy_vector_median", "taubin",        "mean_curvature_flow", "anisotropic_flow",
      "normal_diffusion",    "non_iterative", "bilateral",           "diebel"};
};

template <typename Enum>
Enum enum_of(std::string_view name, const std::string& word) {
  const auto& words = Words<Enum>::kAll;
  const auto found = std::ranges::find(words, word);
  if (found == words.end()) {
    throw Error::parameter(code::kParameterInvalid, std::string(name), word,
                           fmt::format("one of {}", fmt::join(words, ", ")));
  }
  return static_cast<Enum>(found - words.begin());
}

template <typename Enum>
std::string word_of(Enum value) {
  return std::string(Words<Enum>::kAll.at(static_cast<std::size_t>(value)));
}

template <auto Member>
Binding choice(std::string_view name) {
  using Enum = std::decay_t<decltype(std::declval<SmoothOptions>().*Member)>;
  return {name,
          [](SmoothOptions& o, std::string_view n, const OptionValue& v) {
            o.*Member = enum_of<Enum>(n, get_as<std::string>(n, v));
          },
          [](const SmoothOptions& o) { return OptionValue(word_of(o.*Member)); }};
}

constexpr std::string_view kMrf = "mrf";

void set_method(SmoothOptions& options, std::string_view name, const OptionValue& value) {
  const auto& word = get_as<std::string>(name, value);
  options.classical_method.reset();
  if (word != kMrf) options.classical_method = enum_of<ClassicalMethod>(name, word);
}

OptionValue get_method(const SmoothOptions& options) {
  return options.classical_method ? word_of(*options.classical_method) : std::string(kMrf);
}

void set_normal_width(SmoothOptions& options, std::string_view name, const OptionValue& value) {
  options.classical.normal_width = get_as<double>(name, value) * kDegree;
}

OptionValue get_normal_width(const SmoothOptions& options) { return options.classical.normal_width / kDegree; }

const std::vector<Binding>& bindings() {
  using O = SmoothOptions;
  using C = ClassicalOptions;
  static const std::vector<Binding> table{
      {"method", set_method, get_method},
      choice<&O::process>("process"),
      choice<&O::solver>("solver"),
      direct<&O::sweeps, std::uint32_t>("sweeps"),
      direct<&O::seed, std::uint32_t>("seed"),
      direct<&O::threads, std::uint32_t>("threads"),
      choice<&O::likelihood>("likelihood"),
      direct<&O::likelihood_weight, double>("likelihood_weight"),
      direct<&O::likelihood_weight_start, double>("likelihood_weight_start"),
      direct<&O::likelihood_width, double>("likelihood_width"),
      scan_axis<0>("scan_direction_x"),
      scan_axis<1>("scan_direction_y"),
      scan_axis<2>("scan_direction_z"),
      direct<&O::likelihood_across, double>("likelihood_across"),
      direct<&O::volume_weight, double>("volume_weight"),
      choice<&O::smoothness>("smoothness"),
      direct<&O::smoothness_weight, double>("smoothness_weight"),
      degrees<&O::smoothness_width>("smoothness_width_deg"),
      direct<&O::curvature_weight, double>("curvature_weight"),
      direct<&O::edge_process, bool>("edge_process"),
      degrees<&O::sharpness_threshold>("sharpness_threshold_deg"),
      direct<&O::sharpness_weight, double>("sharpness_weight"),
      direct<&O::support_weight, double>("support_weight"),
      choice<&O::ridge_kind>("ridge_kind"),
      degrees<&O::sharpness_limit>("sharpness_limit_deg"),
      direct<&O::continuity_weight, double>("continuity_weight"),
      direct<&O::ridge_line_weight, double>("ridge_line_weight"),
      direct<&O::rounds, std::uint32_t>("rounds"),
      direct<&O::fit_steps, std::uint32_t>("fit_steps"),
      direct<&O::normal_weight, double>("normal_weight"),
      direct<&O::corner_weight, double>("corner_weight"),
      direct<&O::normal_temperature_start, double>("normal_temperature_start"),
      direct<&O::normal_temperature_end, double>("normal_temperature_end"),
      direct<&O::label_temperature_start, double>("label_temperature_start"),
      direct<&O::label_temperature_end, double>("label_temperature_end"),
      direct<&O::vertex_temperature_start, double>("vertex_temperature_start"),
      direct<&O::vertex_temperature_end, double>("vertex_temperature_end"),
      direct<&O::step_size, double>("step_size"),
      classical<&C::iterations>("iterations"),
      classical<&C::step>("flow_step"),
      classical<&C::passband>("passband"),
      classical<&C::spatial_width>("spatial_width"),
      classical<&C::range_width>("range_width"),
      {"normal_width_deg", set_normal_width, get_normal_width},
      classical<&C::fitting_steps>("fitting_steps"),
      classical<&C::likelihood_weight>("diebel_weight"),
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
