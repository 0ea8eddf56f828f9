#pragma once

#include <array>
#include <span>

#include "core/choice/error_model.h"
#include "core/choice/noise_spectrum.h"

namespace crease {

/// Weights of the likelihood that are tried on scans, in units of one over the noise variance.
inline constexpr std::array<double, 10> kScanWeights = [] {
  std::array<double, 10> weights{2.5};
  for (std::size_t k = 1; k < weights.size(); ++k) weights[k] = weights[k - 1] / 2;
  return weights;
}();
/// The first of them, whose results tell how far down to go.
inline constexpr std::size_t kTellingWeights = 5;
/// The finest bands of the spectrum, which tell whether the noise may be correlated at all.
inline constexpr std::size_t kTellingBands = 5;

/// Growth of the lowest density from band to band, and how much more there is elsewhere, band by band; logarithms.
inline constexpr std::size_t kShapeNumbers = 2 * kTellingBands - 1;
std::array<double, kShapeNumbers> shape_of(std::span<const Density, kTellingBands> bands);

/// Odds, as a logarithm, that a mesh whose spectrum looks like this comes out better when its noise counts as
/// correlated: logistic regression on numbers and their squares, the numbers standardised.
struct OddsModel {
  static constexpr std::size_t kNumbers = kShapeNumbers + 1;  ///< the last is the logarithm of the finest density
  std::array<double, kNumbers> means{}, deviations{};
  std::array<double, 2 * kNumbers + 1> factors{};  ///< of the numbers, of their squares, of 1

  static std::array<double, kNumbers> numbers_of(std::span<const Density, kTellingBands> bands);
  /// What the factors are for.
  std::array<double, 2 * kNumbers + 1> terms_of(const std::array<double, kNumbers>& numbers) const;
  double log_odds(const std::array<double, kNumbers>& numbers) const;
};
bool may_be_correlated(std::span<const Density, kTellingBands> bands);

/// Of the logarithms of the mean normal errors of kScanWeights, and of the setting for independent noise, over that of
/// the best of them; more than kWorst counts as kWorst. The features are quantiles of the dihedral angles before and
/// after the last of the telling weights, the risks of these weights, and the shape of the spectrum.
struct ScanModel : ErrorModel<15 + kShapeNumbers, kScanWeights.size() + 1> {
  static constexpr double kWorst = 2.5;
};
using ScanFeatures = ScanModel::Features;
using ScanErrors = ScanModel::Errors;

/// By how much the logarithm of the error must be expected to be lower than with noise that counts as independent:
/// meshes without noise lose much where their shape is taken for noise.
inline constexpr double kLeastGainOfScan = 0.45;

/// Dihedral angles in radians. `risks` of the telling weights.
ScanFeatures scan_features(std::span<const float> angles_measured, std::span<const float> angles_smooth,
                           std::span<const double, kTellingWeights> risks, const NoiseSpectrum& spectrum);

/// Fitted on pairs with correlated noise, with independent noise, and without (tests/quality/fit_scans.cpp).
extern const ScanModel kFittedScanModel;

}  // namespace crease
