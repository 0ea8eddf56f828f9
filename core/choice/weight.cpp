#include "core/choice/weight.h"

#include <algorithm>

#include "core/choice/weight_table.h"

namespace crease {

WeightModel::Features WeightModel::standardised(const Features& features) const {
  Features standard{};
  for (std::size_t k = 0; k < kFeatures; ++k) {
    standard[k] = std::clamp((features[k] - means[k]) / deviations[k], -kFarthest, kFarthest);
  }
  return standard;
}

WeightModel::Errors WeightModel::expected(const Features& features) const {
  const Features standard = standardised(features);
  Errors errors = mean_errors;
  for (std::size_t k = 0; k < kFeatures; ++k) {
    for (std::size_t i = 0; i < errors.size(); ++i) errors[i] += standard[k] * slopes[k][i];
  }
  return errors;
}

std::size_t best_factor(const WeightModel::Errors& errors) {
  constexpr double kLeastGain = 0.005;
  const auto least = static_cast<std::size_t>(std::ranges::min_element(errors) - errors.begin());
  return errors[least] < errors[kOwnWeight] - kLeastGain ? least : kOwnWeight;
}

double weight_factor(const Features& features) {
  return kWeightFactors.at(best_factor(kFittedWeightModel.expected(features)));
}

const WeightModel kFittedWeightModel{kWeightFeatureMeans, kWeightFeatureDeviations, kWeightMeanErrors, kWeightSlopes};

}  // namespace crease
