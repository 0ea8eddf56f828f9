#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/options/parameters.h"

namespace crease {
namespace {

/// Another value than the default that the place takes.
ParameterValue other_value(const Parameter& parameter, const ParameterPlace& place) {
  const ParameterValue usual = default_value(parameter, place);
  switch (place.type) {
    case ParameterType::kBoolean:
      return !std::get<bool>(usual);
    case ParameterType::kInteger:
      return static_cast<std::uint32_t>(std::get<std::uint32_t>(usual) == place.max ? place.max - 1 : place.max);
    case ParameterType::kNumber:
      return std::get<double>(usual) == place.max ? (place.min + place.max) / 2 : place.max;
    case ParameterType::kWord:
      break;
  }
  return std::string(place.words[place.words[0] == std::get<std::string>(usual) ? 1 : 0]);
}

TEST(ParameterRows, AreWithoutFaults) { EXPECT_NO_THROW(check_parameter_table()); }

TEST(ParameterRows, EachPlaceIsAMemberOfItsOwn) {
  for (std::size_t method = 0; method < method_names().size(); ++method) {
    for (const Parameter& changed : parameter_table()) {
      const ParameterPlace* place = changed.place_for(method);
      if (place == nullptr || changed.name == "method") continue;
      JobOptions options;
      options.smooth.method = default_method(method);
      const ParameterValue value = other_value(changed, *place);
      place->set(options, value);
      EXPECT_EQ(place->get(options), value) << changed.name;
      for (const Parameter& kept : parameter_table()) {
        const ParameterPlace* other = kept.place_for(method);
        if (other == nullptr || kept.name == changed.name) continue;
        EXPECT_EQ(text_of(other->get(options)),
                  text_of(kept.name == "method" ? std::string(method_names()[method]) : default_value(kept, *other)))
            << kept.name << " after " << changed.name;
      }
    }
  }
}

TEST(ParameterRows, EveryMethodHasItsDefaultsThroughTheTable) {
  for (std::size_t method = 0; method < method_names().size(); ++method) {
    JobOptions defaults;
    defaults.smooth.method = default_method(method);
    defaults.smooth.threads = 2;
    const ResolvedParameters resolved =
        resolve_parameters({{"method", std::string(method_names()[method])}, {"threads", 2U}});
    EXPECT_EQ(resolved.values, values_of(defaults)) << method_names()[method];
    EXPECT_EQ(values_of(resolved.options), resolved.values);
    EXPECT_TRUE(resolved.warnings.empty());
  }
}

TEST(ParameterRows, WhatIsResolvedGoesIntoOptionsAndBack) {
  for (const Parameter& parameter : parameter_table()) {
    for (const ParameterPlace& place : parameter.places) {
      ParameterValues given{{"threads", 2U}};
      if (place.method) given["method"] = std::string(method_names()[*place.method]);
      for (const ParameterCondition& condition : parameter.conditions) {
        given[std::string(condition.parameter)] = parse_value(find_parameter(condition.parameter), condition.words[0]);
      }
      given[std::string(parameter.name)] = other_value(parameter, place);
      const ResolvedParameters resolved = resolve_parameters(given);
      EXPECT_TRUE(resolved.warnings.empty()) << parameter.name;
      EXPECT_EQ(resolved.values.at(std::string(parameter.name)), other_value(parameter, place));
      const ParameterValues back = values_of(resolved.options);
      ASSERT_EQ(back.size(), resolved.values.size());
      for (const auto& [name, value] : resolved.values) {
        EXPECT_EQ(text_of(back.at(name)), text_of(value)) << name << " with " << parameter.name;
      }
      EXPECT_EQ(resolve_parameters(resolved.values).values, resolved.values);
    }
  }
}

TEST(ParameterRows, NumbersAreRefusedOutsideTheRangeOfTheMethod) {
  for (const Parameter& parameter : parameter_table()) {
    for (const ParameterPlace& place : parameter.places) {
      if (place.type != ParameterType::kNumber || !place.method) continue;
      ParameterValues given{{"method", std::string(method_names()[*place.method])}};
      for (const ParameterCondition& condition : parameter.conditions) {
        given[std::string(condition.parameter)] = parse_value(find_parameter(condition.parameter), condition.words[0]);
      }
      for (const double beyond : {place.min - 1e-5, place.max * 1.01}) {
        given[std::string(parameter.name)] = beyond;
        EXPECT_THROW(resolve_parameters(given), Error) << parameter.name << "=" << beyond;
      }
      for (const double end : {place.min, place.max}) {
        given[std::string(parameter.name)] = end;
        EXPECT_NO_THROW(resolve_parameters(given)) << parameter.name << "=" << end;
      }
    }
  }
}

TEST(ParameterRows, DefaultsAreThoseOfTheStructs) {
  const auto value = [](std::string_view name, std::string_view method) {
    const Parameter& parameter = find_parameter(name);
    const auto& names = method_names();
    const auto index = static_cast<std::size_t>(std::ranges::find(names, method) - names.begin());
    return default_value(parameter, *parameter.place_for(index));
  };
  EXPECT_EQ(value("sweeps", "mrf"), ParameterValue(MrfOptions{}.sweeps));
  EXPECT_EQ(value("flow_step", "taubin"), ParameterValue(TaubinOptions{}.step));
  EXPECT_EQ(value("normal_width_deg", "anisotropic_flow"), ParameterValue(80.0));
  EXPECT_EQ(value("retention_hours", "diebel"), ParameterValue(JobOptions{}.retention_hours));
}

}  // namespace
}  // namespace crease
