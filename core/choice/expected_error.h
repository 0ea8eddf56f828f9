#pragma once

#include <array>

#include "core/choice/families.h"
#include "core/choice/features.h"

namespace crease {

/// A linear model of the errors, which are cut off at kWorst. Features are standardised, and cut off at kFarthest
/// deviations.
struct ErrorModel {
  static constexpr double kWorst = 0.8, kFarthest = 3;

  Features means{}, deviations{};
  std::array<double, kSettings.size()> constants{};
  std::array<Features, kSettings.size()> weights{};
};

/// The model that was fitted on the training pairs of tests/quality (tests/quality/fit_choice.cpp).
extern const ErrorModel kFittedModel;

/// Per setting of kSettings: the expected logarithm of the mean normal error over that of the best of them.
std::array<double, kSettings.size()> expected_log_errors(const Features& features,
                                                         const ErrorModel& model = kFittedModel);

}  // namespace crease
