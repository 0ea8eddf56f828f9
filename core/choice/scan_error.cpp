#include "core/choice/scan_error.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/choice/scan_error_table.h"

namespace crease {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr std::array<double, 5> kShares{0.1, 0.25, 0.5, 0.75, 0.9};

double log_of_degrees(double angle) {
  constexpr double kLeastDegrees = 1e-3;
  return std::log(std::max(kLeastDegrees, angle / kDegree));
}

/// Logarithms of the quantiles at kShares.
std::array<double, kShares.size()> quantiles(std::span<const float> angles) {
  std::vector<float> sorted(angles.begin(), angles.end());
  std::array<double, kShares.size()> result{};
  for (std::size_t k = 0; k < kShares.size() && !sorted.empty(); ++k) {
    const auto place = static_cast<std::ptrdiff_t>(kShares[k] * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), sorted.begin() + place, sorted.end());
    result[k] = log_of_degrees(static_cast<double>(sorted[static_cast<std::size_t>(place)]));
  }
  return result;
}

/// Logarithm of the mean; what is sharper than a ridge counts as one.
double mean(std::span<const float> angles) {
  constexpr double kRidge = 20 * kDegree;
  double sum = 0;
  for (const float angle : angles) sum += std::min(kRidge, static_cast<double>(angle));
  return log_of_degrees(sum / static_cast<double>(std::max<std::size_t>(1, angles.size())));
}

}  // namespace

std::array<double, kShapeNumbers> shape_of(std::span<const Density, kTellingBands> bands) {
  std::array<double, kShapeNumbers> shape{};
  for (std::size_t k = 0; k + 1 < kTellingBands; ++k) shape[k] = std::log(bands[k + 1].low / bands[k].low);
  for (std::size_t k = 0; k < kTellingBands; ++k) shape[kTellingBands - 1 + k] = std::log(bands[k].high / bands[k].low);
  return shape;
}

std::array<double, OddsModel::kNumbers> OddsModel::numbers_of(std::span<const Density, kTellingBands> bands) {
  std::array<double, kNumbers> numbers{};
  std::ranges::copy(shape_of(bands), numbers.begin());
  numbers.back() = std::log(bands[0].low);
  return numbers;
}

std::array<double, 2 * OddsModel::kNumbers + 1> OddsModel::terms_of(const std::array<double, kNumbers>& numbers) const {
  constexpr double kFarthest = 3;
  std::array<double, 2 * kNumbers + 1> terms{};
  for (std::size_t k = 0; k < kNumbers; ++k) {
    terms[k] = std::clamp((numbers[k] - means[k]) / deviations[k], -kFarthest, kFarthest);
    terms[kNumbers + k] = terms[k] * terms[k];
  }
  terms.back() = 1;
  return terms;
}

double OddsModel::log_odds(const std::array<double, kNumbers>& numbers) const {
  const auto terms = terms_of(numbers);
  double sum = 0;
  for (std::size_t k = 0; k < terms.size(); ++k) sum += factors[k] * terms[k];
  return sum;
}

bool may_be_correlated(std::span<const Density, kTellingBands> bands) {
  return kFittedOdds.log_odds(OddsModel::numbers_of(bands)) > 0;
}

ScanFeatures scan_features(std::span<const float> angles_measured, std::span<const float> angles_smooth,
                           std::span<const double, kTellingWeights> risks, const NoiseSpectrum& spectrum) {
  ScanFeatures features{};
  auto next = std::ranges::copy(quantiles(angles_smooth), features.begin()).out;
  *next++ = mean(angles_measured);
  next = std::ranges::copy(quantiles(angles_measured), next).out;
  for (std::size_t k = 1; k < kTellingWeights; ++k) *next++ = std::log(risks[k] / risks[0]);
  std::ranges::copy(shape_of(std::span(spectrum.bands).first<kTellingBands>()), next);
  return features;
}

const ScanModel kFittedScanModel{{kScanFeatureMeans, kScanFeatureDeviations, kScanMeanErrors, kScanLandmarks}};

}  // namespace crease
