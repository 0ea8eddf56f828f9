#include "core/choice/expected_error.h"

#include <algorithm>
#include <cmath>

#include "core/choice/expected_error_table.h"

namespace crease {

const ErrorModel kFittedModel{kFeatureMeans, kFeatureDeviations, kMeanErrors, kLandmarks};

std::array<std::int8_t, kFeatures> ErrorModel::standardised(const Features& features) const {
  std::array<std::int8_t, kFeatures> steps{};
  for (std::size_t k = 0; k < kFeatures; ++k) {
    const double deviation = std::clamp((features[k] - means[k]) / deviations[k], -kFarthest, kFarthest);
    steps[k] = static_cast<std::int8_t>(std::lround(deviation * kStepsPerDeviation));
  }
  return steps;
}

double likeness(const std::array<std::int8_t, kFeatures>& a, const std::array<std::int8_t, kFeatures>& b) {
  int squares = 0;
  for (std::size_t k = 0; k < kFeatures; ++k) squares += (a[k] - b[k]) * (a[k] - b[k]);
  constexpr double kUnit = ErrorModel::kStepsPerDeviation * ErrorModel::kStepsPerDeviation * kFeatures;
  return std::exp(-squares / kUnit);
}

SettingErrors expected_log_errors(const Features& features, const ErrorModel& model) {
  const auto description = model.standardised(features);
  SettingErrors errors = model.mean_errors;
  for (const Landmark& landmark : model.landmarks) {
    const double alike = likeness(description, landmark.features);
    for (std::size_t i = 0; i < errors.size(); ++i) errors[i] += alike * landmark.influence[i];
  }
  return errors;
}

}  // namespace crease
