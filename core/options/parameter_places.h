#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "core/options/parameters.h"

/// How the rows of the table name the members that a parameter is bound to.
namespace crease::places {

template <typename T>
struct MemberPointer;
template <typename Owner, typename T>
struct MemberPointer<T Owner::*> {
  using Struct = Owner;
  using Type = T;
};
template <auto Member>
using StructOf = typename MemberPointer<decltype(Member)>::Struct;
template <auto Member>
using TypeOf = typename MemberPointer<decltype(Member)>::Type;

/// The index of an alternative of Method; of the options that all methods share it is none.
template <typename Options, std::size_t kIndex = 0>
constexpr std::optional<std::size_t> method_index() {
  if constexpr (kIndex == std::variant_size_v<Method>) {
    return std::nullopt;
  } else if constexpr (std::is_same_v<Options, std::variant_alternative_t<kIndex, Method>>) {
    return kIndex;
  } else {
    return method_index<Options, kIndex + 1>();
  }
}

template <typename Options, typename Job>
auto& part_of(Job& job) {
  if constexpr (std::is_same_v<Options, JobOptions>) {
    return job;
  } else if constexpr (std::is_same_v<Options, SmoothOptions>) {
    return job.smooth;
  } else {
    return std::get<Options>(job.smooth.method);
  }
}

template <typename T>
constexpr ParameterType type_of() {
  if constexpr (std::is_same_v<T, bool>) {
    return ParameterType::kBoolean;
  } else if constexpr (std::is_same_v<T, std::uint32_t>) {
    return ParameterType::kInteger;
  } else if constexpr (std::is_same_v<T, double>) {
    return ParameterType::kNumber;
  } else {
    static_assert(std::is_enum_v<T>);
    return ParameterType::kWord;
  }
}

/// Degrees of an angle in radians. Rounded, so that what was written as 20 degrees reads so.
inline double degrees_of(double radians) { return std::round(radians / kDegree * 1e9) / 1e9; }

/// The places of a boolean or of a choice: `at<&MrfOptions::process>()`.
template <auto Member>
std::vector<ParameterPlace> at() {
  using T = TypeOf<Member>;
  using Options = StructOf<Member>;
  ParameterPlace place{.method = method_index<Options>(), .type = type_of<T>()};
  if constexpr (std::is_enum_v<T>) {
    const auto all_words = words_of(T{});
    place.words.assign(all_words.begin(), all_words.end());
    place.get = [](const JobOptions& job) -> ParameterValue {
      return std::string(words_of(T{}).at(static_cast<std::size_t>(part_of<Options>(job).*Member)));
    };
    place.set = [](JobOptions& job, const ParameterValue& value) {
      const auto words = words_of(T{});
      const auto word = std::find(words.begin(), words.end(), std::get<std::string>(value));
      part_of<Options>(job).*Member = static_cast<T>(word - words.begin());
    };
  } else {
    place.get = [](const JobOptions& job) -> ParameterValue { return part_of<Options>(job).*Member; };
    place.set = [](JobOptions& job, const ParameterValue& value) {
      part_of<Options>(job).*Member = std::get<T>(value);
    };
  }
  return {place};
}

/// The places of a number in one or several methods with one range: `at<&TaubinOptions::step, …>(0, 1)`.
template <auto... Members>
std::vector<ParameterPlace> at(double min, double max) {
  std::vector<ParameterPlace> places;
  const auto add = [&](std::vector<ParameterPlace> one) {
    one.front().min = min;
    one.front().max = max;
    places.push_back(std::move(one.front()));
  };
  (add(at<Members>()), ...);
  return places;
}

/// The same for angles, which are degrees for users and radians in options.
template <auto... Members>
std::vector<ParameterPlace> degrees_at(double min, double max) {
  std::vector<ParameterPlace> places;
  (places.push_back({.method = method_index<StructOf<Members>>(),
                     .type = ParameterType::kNumber,
                     .get = [](const JobOptions& job) -> ParameterValue {
                       return degrees_of(part_of<StructOf<Members>>(job).*Members);
                     },
                     .set =
                         [](JobOptions& job, const ParameterValue& value) {
                           part_of<StructOf<Members>>(job).*Members = std::get<double>(value) * kDegree;
                         },
                     .min = min,
                     .max = max}),
   ...);
  return places;
}

/// The same for one coordinate of a vector.
template <auto Member, Eigen::Index kAxis>
std::vector<ParameterPlace> axis_at(double min, double max) {
  using Options = StructOf<Member>;
  return {{.method = method_index<Options>(),
           .type = ParameterType::kNumber,
           .get = [](const JobOptions& job) -> ParameterValue { return (part_of<Options>(job).*Member)[kAxis]; },
           .set = [](JobOptions& job,
                     const ParameterValue& value) { (part_of<Options>(job).*Member)[kAxis] = std::get<double>(value); },
           .min = min,
           .max = max}};
}

/// Several places, where ranges differ from method to method.
template <typename... More>
std::vector<ParameterPlace> all(std::vector<ParameterPlace> first, const More&... more) {
  (first.insert(first.end(), more.begin(), more.end()), ...);
  return first;
}

}  // namespace crease::places
