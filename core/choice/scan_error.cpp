#include "core/choice/scan_error.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/base/quantile.h"
#include "core/choice/scan_error_table.h"

namespace crease {
namespace {

constexpr double kOneDegree = std::numbers::pi / 180;
constexpr std::array<double, 5> kShares{0.1, 0.25, 0.5, 0.75, 0.9};

double log_of_degrees(double angle) {
  constexpr double kLeastDegrees = 1e-3;
  return std::log(std::max(kLeastDegrees, angle / kOneDegree));
}

double log_of(double value) {
  constexpr double kLeast = 1e-9;
  return std::log(std::max(kLeast, value));
}

std::array<double, 3> numbers_of_capture(const CaptureSigns& signs) {
  return {signs.exact_flats, signs.facing, signs.regular};
}

/// They are the first of the features.
CaptureSigns capture_of(const ScanFeatures& features) { return {features[0], features[1], features[2]}; }

/// Logarithms of the quantiles at kShares.
std::array<double, kShares.size()> log_quantiles(std::span<const float> angles) {
  auto result = quantiles(std::vector<float>(angles.begin(), angles.end()), kShares);
  for (double& angle : result) angle = log_of_degrees(angle);
  return result;
}

/// Logarithm of the mean; what is sharper than a ridge counts as one.
double mean(std::span<const float> angles) {
  constexpr double kRidge = 20 * kOneDegree;
  double sum = 0;
  for (const float angle : angles) sum += std::min(kRidge, static_cast<double>(angle));
  return log_of_degrees(sum / static_cast<double>(std::max<std::size_t>(1, angles.size())));
}

}  // namespace

ScanOdds::Numbers scan_numbers(const NoiseSpectrum& spectrum) {
  const auto& bands = spectrum.bands;
  ScanOdds::Numbers numbers{};
  auto next = numbers.begin();
  for (std::size_t k = 0; k + 1 < kTellingBands; ++k) *next++ = std::log(bands[k + 1].low / bands[k].low);
  for (std::size_t k = 0; k < kTellingBands; ++k) *next++ = log_of(bands[k].high / bands[k].low);
  *next++ = std::log(bands[0].low);
  for (const double sign : numbers_of_capture(spectrum.capture)) *next++ = sign;
  return numbers;
}

bool may_be_correlated(const NoiseSpectrum& spectrum) { return kScanOdds.log_odds(scan_numbers(spectrum)) > 0; }

bool counts_as_scan(const ScanModel& model, const ScanFeatures& features) {
  constexpr double kLeastGain = 0.15, kUnfamiliar = 1, kLeastGainOfOneView = 0, kUnfamiliarView = 0.65;
  const ScanErrors errors = model.expected(features);
  const double gain = errors.back() - *std::min_element(errors.begin(), errors.end() - 1);
  const double unfamiliarity = 1 - model.familiarity(features);
  return capture_of(features).is_one_view() ? gain > kLeastGainOfOneView + kUnfamiliarView * unfamiliarity
                                            : gain > kLeastGain + kUnfamiliar * unfamiliarity;
}

ScanFeatures scan_features(std::span<const float> angles_measured, std::span<const ScanLook> looks,
                           const NoiseSpectrum& spectrum) {
  ScanFeatures features{};
  auto next = std::ranges::copy(numbers_of_capture(spectrum.capture), features.begin()).out;
  *next++ = log_of(spectrum.sigma());
  *next++ = spectrum.length();
  for (const Density& band : spectrum.bands) {
    for (const double density : {band.low, band.half, band.high}) *next++ = log_of(density);
  }
  const auto add_angles = [&](std::span<const float> angles) {
    next = std::ranges::copy(log_quantiles(angles), next).out;
    *next++ = mean(angles);
  };
  add_angles(angles_measured);
  for (const ScanLook& look : looks) {
    add_angles(look.angles);
    *next++ = log_of(std::sqrt(look.residual));
  }
  return features;
}

NoiseSpectrum spectrum_of(const ScanFeatures& features) {
  constexpr std::ptrdiff_t kBeforeBands = 5;  // signs of the capture, level, length
  NoiseSpectrum spectrum;
  spectrum.capture = capture_of(features);
  auto next = features.begin() + kBeforeBands;
  for (Density& band : spectrum.bands) {
    for (double* density : {&band.low, &band.half, &band.high}) *density = std::exp(*next++);
  }
  return spectrum;
}

const ScanOdds kScanOdds = kFittedScanOdds;
const ScanModel kFittedScanModel{{kScanFeatureMeans, kScanFeatureDeviations, kScanMeanErrors, kScanLandmarks}};

}  // namespace crease
