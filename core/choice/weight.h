#pragma once

#include <array>

#include "core/choice/features.h"

namespace crease {

/// What the weight of the likelihood of the chosen setting may be multiplied with.
inline constexpr std::array kWeightFactors{0.5, 0.7, 1.0, 1.4, 2.0};
inline constexpr std::size_t kOwnWeight = 2;
static_assert(kWeightFactors[kOwnWeight] == 1);

/// A line through the logarithms of the errors that a result with each of kWeightFactors has after the regressions,
/// over the error with the setting's own weight. Features are standardised.
struct WeightModel {
  using Features = crease::Features;
  using Errors = std::array<double, kWeightFactors.size()>;

  Features means{}, deviations{};
  Errors mean_errors{};
  std::array<Errors, kFeatures> slopes{};  ///< per standard deviation

  Errors expected(const Features& features) const;
};

/// Of some errors, the number of the factor that is best by a margin, or else that of the setting's own weight.
std::size_t best_factor(const WeightModel::Errors& errors);

/// The factor with the smallest expected error. Settings are chosen by what a descent makes of them; the regressions
/// take away noise that it leaves, but hardly bring back detail that it took. `features` are those of the reference.
double weight_factor(const Features& features);

/// Fitted on the training pairs of tests/quality (tests/quality/fit_weights.cpp).
extern const WeightModel kFittedWeightModel;

}  // namespace crease
