#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/choice/families.h"
#include "core/choice/features.h"

namespace crease {

/// A number for each of kSettings.
using SettingErrors = std::array<double, kSettings.size()>;

/// A training pair that the model knows.
struct Landmark {
  std::array<std::int8_t, kFeatures> features{};  ///< standardised, in 1 / ErrorModel::kStepsPerDeviation
  SettingErrors influence{};                      ///< on the errors of uploads that look alike
};

/// Kernel ridge regression of the errors, which are cut off at kWorst, on features that are standardised and cut off at
/// kFarthest deviations. What resembles no landmark has the mean errors of the training pairs.
struct ErrorModel {
  static constexpr double kWorst = 0.8, kFarthest = 3, kStepsPerDeviation = 40;

  Features means{}, deviations{};
  SettingErrors mean_errors{};
  std::span<const Landmark> landmarks;

  /// In 1 / kStepsPerDeviation.
  std::array<std::int8_t, kFeatures> standardised(const Features& features) const;
};

/// How much alike two standardised descriptions are, from 0 to 1.
double likeness(const std::array<std::int8_t, kFeatures>& a, const std::array<std::int8_t, kFeatures>& b);

/// The model that was fitted on the training pairs of tests/quality (tests/quality/fit_choice.cpp).
extern const ErrorModel kFittedModel;

/// Per setting: the expected logarithm of the mean normal error over that of the best of them.
SettingErrors expected_log_errors(const Features& features, const ErrorModel& model = kFittedModel);

}  // namespace crease
