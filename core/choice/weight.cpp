#include "core/choice/weight.h"

#include "core/choice/error_model.h"
#include "core/choice/ranking.h"
#include "core/choice/weight_table.h"

namespace crease {

WeightModel::Errors WeightModel::expected(const Features& features) const {
  Errors errors = mean_errors;
  for (std::size_t k = 0; k < kFeatures; ++k) {
    const double deviation = standardised(features[k], means[k], deviations[k]);
    for (std::size_t i = 0; i < errors.size(); ++i) errors[i] += deviation * slopes[k][i];
  }
  return errors;
}

std::size_t best_factor(const WeightModel::Errors& errors) {
  constexpr double kLeastGain = 0.005;
  const std::size_t least = best_of(errors);
  return errors[least] < errors[kOwnWeight] - kLeastGain ? least : kOwnWeight;
}

double weight_factor(const Features& features) {
  return kWeightFactors.at(best_factor(kFittedWeightModel.expected(features)));
}

const WeightModel kFittedWeightModel{kWeightFeatureMeans, kWeightFeatureDeviations, kWeightMeanErrors, kWeightSlopes};

}  // namespace crease
