#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

namespace crease {

/// What likeness falls with: the square of the distance between two descriptions, or the distance itself, which follows
/// the nearest pairs more closely.
enum class Kernel { kGaussian, kExponential };

/// A number less its mean, in deviations, no further than three of them: what the models read.
inline double standardised(double number, double mean, double deviation) {
  constexpr double kFarthest = 3;
  return std::clamp((number - mean) / deviation, -kFarthest, kFarthest);
}

/// Kernel ridge regression of the errors of some methods on features of an upload, which are standardised. What
/// resembles no landmark has the mean errors of the training pairs.
template <std::size_t kFeatureCount, std::size_t kMethods, Kernel kKernel>
struct ErrorModel {
  static constexpr double kStepsPerDeviation = 40;
  using Features = std::array<double, kFeatureCount>;
  using Description = std::array<std::int8_t, kFeatureCount>;  ///< standardised, in 1 / kStepsPerDeviation
  using Errors = std::array<double, kMethods>;

  /// A training pair that the model knows.
  struct Landmark {
    Description features{};
    Errors influence{};  ///< on the errors of uploads that look alike
  };

  Features means{}, deviations{};
  Errors mean_errors{};
  std::span<const Landmark> landmarks;

  Description described(const Features& features) const {
    Description steps{};
    for (std::size_t k = 0; k < kFeatureCount; ++k) {
      const double deviation = standardised(features[k], means[k], deviations[k]);
      steps[k] = static_cast<std::int8_t>(std::lround(deviation * kStepsPerDeviation));
    }
    return steps;
  }

  /// How much alike two descriptions are, from 0 to 1.
  static double likeness(const Description& a, const Description& b) {
    int squares = 0;
    for (std::size_t k = 0; k < kFeatureCount; ++k) squares += (a[k] - b[k]) * (a[k] - b[k]);
    constexpr double kUnit = kStepsPerDeviation * kStepsPerDeviation * kFeatureCount;
    const double square = squares / kUnit;
    return std::exp(kKernel == Kernel::kGaussian ? -square : -std::sqrt(square));
  }

  /// How much alike the most similar training pair is, from 0 to 1.
  double familiarity(const Features& features) const {
    const Description description = described(features);
    double most = 0;
    for (const Landmark& landmark : landmarks) most = std::max(most, likeness(description, landmark.features));
    return most;
  }

  /// Per method.
  Errors expected(const Features& features) const {
    const Description description = described(features);
    Errors errors = mean_errors;
    for (const Landmark& landmark : landmarks) {
      const double alike = likeness(description, landmark.features);
      for (std::size_t i = 0; i < errors.size(); ++i) errors[i] += alike * landmark.influence[i];
    }
    return errors;
  }
};

}  // namespace crease
