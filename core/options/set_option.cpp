#include "core/options/set_option.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <type_traits>
#include <utility>

#include "core/error.h"

namespace crease {
namespace {

std::string text(const OptionValue& value) {
  return std::visit([](const auto& v) { return fmt::format("{}", v); }, value);
}

/// What the API calls an option, and how it is read from and written to the struct; no value where the method has none.
struct Binding {
  std::string_view name;
  void (*set)(SmoothOptions&, std::string_view name, const OptionValue&);
  std::optional<OptionValue> (*get)(const SmoothOptions&);
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

template <typename Owner, typename T>
Owner owner_of(T Owner::*);
template <typename Owner, typename T>
T type_of(T Owner::*);

template <auto Member>
bool set_member(SmoothOptions& options, std::string_view name, const OptionValue& value, double unit) {
  using T = decltype(type_of(Member));
  auto* method = std::get_if<decltype(owner_of(Member))>(&options.method);
  if (method == nullptr) return false;
  if constexpr (std::is_enum_v<T>) {
    method->*Member = enum_of<T>(name, get_as<std::string>(name, value));
  } else {
    const T given = get_as<T>(name, value);
    const bool is_own = !std::holds_alternative<MrfOptions>(options.method) && given == T{};
    if constexpr (std::is_same_v<T, double>) {
      if (!is_own) method->*Member = given * unit;
    } else {
      if (!is_own) method->*Member = given;
    }
  }
  return true;
}

template <auto Member>
std::optional<OptionValue> get_member(const SmoothOptions& options, double unit) {
  using T = decltype(type_of(Member));
  const auto* method = std::get_if<decltype(owner_of(Member))>(&options.method);
  if (method == nullptr) return std::nullopt;
  if constexpr (std::is_enum_v<T>) {
    return OptionValue(word_of(method->*Member));
  } else if constexpr (std::is_same_v<T, double>) {
    return OptionValue(method->*Member / unit);
  } else {
    return OptionValue(method->*Member);
  }
}

template <auto... Members>
std::optional<OptionValue> get_any(const SmoothOptions& options, double unit) {
  std::optional<OptionValue> value;
  ((value = get_member<Members>(options, unit)) || ...);
  return value;
}

template <auto... Members>
Binding direct(std::string_view name) {
  return {name,
          [](SmoothOptions& o, std::string_view n, const OptionValue& v) { (set_member<Members>(o, n, v, 1) || ...); },
          [](const SmoothOptions& o) { return get_any<Members...>(o, 1); }};
}

template <auto... Members>
Binding degrees(std::string_view name) {
  return {name,
          [](SmoothOptions& o, std::string_view n, const OptionValue& v) {
            (set_member<Members>(o, n, v, kDegree) || ...);
          },
          [](const SmoothOptions& o) { return get_any<Members...>(o, kDegree); }};
}

template <Eigen::Index kAxis>
Binding scan_axis(std::string_view name) {
  return {name,
          [](SmoothOptions& o, std::string_view n, const OptionValue& v) {
            if (auto* mrf = std::get_if<MrfOptions>(&o.method)) mrf->scan_direction[kAxis] = get_as<double>(n, v);
          },
          [](const SmoothOptions& o) {
            const auto* mrf = std::get_if<MrfOptions>(&o.method);
            return mrf != nullptr ? std::optional<OptionValue>(mrf->scan_direction[kAxis]) : std::nullopt;
          }};
}

template <std::size_t kIndex = 0>
Method method_of(std::string_view name, const std::string& word) {
  if constexpr (kIndex == std::variant_size_v<Method>) {
    throw Error::parameter(code::kParameterInvalid, std::string(name), word, "the name of a method");
  } else {
    using Options = std::variant_alternative_t<kIndex, Method>;
    return word == Options::kName ? Method(Options{}) : method_of<kIndex + 1>(name, word);
  }
}

void set_method(SmoothOptions& options, std::string_view name, const OptionValue& value) {
  options.method = method_of(name, get_as<std::string>(name, value));
}

std::optional<OptionValue> get_method(const SmoothOptions& options) {
  return std::visit([](const auto& method) { return OptionValue(std::string(method.kName)); }, options.method);
}

void set_threads(SmoothOptions& options, std::string_view name, const OptionValue& value) {
  options.threads = get_as<std::uint32_t>(name, value);
}

std::optional<OptionValue> get_threads(const SmoothOptions& options) { return OptionValue(options.threads); }

const std::vector<Binding>& bindings() {
  using O = MrfOptions;
  using Fuzzy = FuzzyVectorMedianOptions;
  using Flow = MeanCurvatureFlowOptions;
  using Anisotropic = AnisotropicFlowOptions;
  using Diffusion = NormalDiffusionOptions;
  static const std::vector<Binding> table{
      {"method", set_method, get_method},
      direct<&O::process>("process"),
      direct<&O::solver>("solver"),
      direct<&O::sweeps>("sweeps"),
      direct<&O::seed>("seed"),
      {"threads", set_threads, get_threads},
      direct<&O::likelihood>("likelihood"),
      direct<&O::likelihood_weight>("likelihood_weight"),
      direct<&O::likelihood_weight_start>("likelihood_weight_start"),
      direct<&O::likelihood_width>("likelihood_width"),
      scan_axis<0>("scan_direction_x"),
      scan_axis<1>("scan_direction_y"),
      scan_axis<2>("scan_direction_z"),
      direct<&O::likelihood_across>("likelihood_across"),
      direct<&O::volume_weight>("volume_weight"),
      direct<&O::smoothness>("smoothness"),
      direct<&O::smoothness_weight>("smoothness_weight"),
      degrees<&O::smoothness_width>("smoothness_width_deg"),
      direct<&O::curvature_weight>("curvature_weight"),
      direct<&O::edge_process>("edge_process"),
      degrees<&O::sharpness_threshold>("sharpness_threshold_deg"),
      direct<&O::sharpness_weight>("sharpness_weight"),
      direct<&O::support_weight>("support_weight"),
      direct<&O::ridge_kind>("ridge_kind"),
      degrees<&O::sharpness_limit>("sharpness_limit_deg"),
      direct<&O::continuity_weight>("continuity_weight"),
      direct<&O::ridge_line_weight>("ridge_line_weight"),
      direct<&O::rounds>("rounds"),
      direct<&O::fit_steps>("fit_steps"),
      direct<&O::normal_weight>("normal_weight"),
      direct<&O::corner_weight>("corner_weight"),
      direct<&O::normal_temperature_start>("normal_temperature_start"),
      direct<&O::normal_temperature_end>("normal_temperature_end"),
      direct<&O::label_temperature_start>("label_temperature_start"),
      direct<&O::label_temperature_end>("label_temperature_end"),
      direct<&O::vertex_temperature_start>("vertex_temperature_start"),
      direct<&O::vertex_temperature_end>("vertex_temperature_end"),
      direct<&O::step_size>("step_size"),
      direct<&Fuzzy::iterations, &TaubinOptions::iterations, &Flow::iterations, &Anisotropic::iterations,
             &Diffusion::iterations, &BilateralOptions::iterations, &DiebelOptions::iterations>("iterations"),
      direct<&TaubinOptions::step, &Flow::step, &Anisotropic::step, &Diffusion::step>("flow_step"),
      direct<&TaubinOptions::passband>("passband"),
      direct<&BilateralOptions::spatial_width, &NonIterativeOptions::spatial_width>("spatial_width"),
      direct<&BilateralOptions::range_width, &NonIterativeOptions::range_width>("range_width"),
      degrees<&Fuzzy::normal_width, &Diffusion::normal_width, &Anisotropic::normal_width>("normal_width_deg"),
      direct<&Fuzzy::fitting_steps, &Diffusion::fitting_steps>("fitting_steps"),
      direct<&DiebelOptions::likelihood_weight>("diebel_weight"),
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
  for (const Binding& binding : bindings()) {
    if (const auto value = binding.get(options)) values.emplace_back(binding.name, *value);
  }
  return values;
}

}  // namespace crease
