#include "core/graduated/latent_variance.h"

#include <algorithm>
#include <cmath>

namespace crease {
namespace {

constexpr double kHeavyTails = 3.8, kLeastMeanSquare = 1e-6;
constexpr int kRounds = 25;

std::vector<double> squares_of(std::span<const float> residuals) {
  std::vector<double> squares;
  squares.reserve(residuals.size());
  for (const float r : residuals) squares.push_back(static_cast<double>(r) * static_cast<double>(r));
  return squares;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(std::max<std::size_t>(1, values.size()));
}

class Mixture {
 public:
  Mixture(const std::vector<double>& squares, double floor) : squares_(squares), floor_(floor), small_(squares.size()) {
    const double mean = mean_of(squares);
    variance1 = std::max(floor, 0.05 * mean);
    variance2 = std::max(variance1, 2 * mean);
  }

  void fit() {
    for (int round = 0; round < kRounds; ++round) {
      expect();
      maximize();
    }
  }

  /// Sets small(i), the probability that residual i has the smaller variance. Returns Σ log density, without the
  /// constant.
  double expect() {
    const double h1 = share / std::sqrt(variance1), h2 = (1 - share) / std::sqrt(variance2);
    double log_likelihood = 0;
    for (std::size_t i = 0; i < squares_.size(); ++i) {
      const double p1 = h1 * std::exp(-0.5 * squares_[i] / variance1);
      const double p2 = h2 * std::exp(-0.5 * squares_[i] / variance2) + 1e-300;
      small_[i] = p1 / (p1 + p2);
      log_likelihood += std::log(p1 + p2);
    }
    return log_likelihood;
  }

  double small(std::size_t i) const { return small_[i]; }

  double variance1 = 0, variance2 = 0, share = 0.5;

 private:
  void maximize() {
    double count = 0, sum1 = 0, sum2 = 0;
    for (std::size_t i = 0; i < squares_.size(); ++i) {
      count += small_[i];
      sum1 += small_[i] * squares_[i];
      sum2 += (1 - small_[i]) * squares_[i];
    }
    const auto all = static_cast<double>(squares_.size());
    variance1 = std::max(floor_, sum1 / std::max(count, 1.0));
    variance2 = std::max(variance1, sum2 / std::max(all - count, 1.0));
    share = std::clamp(count / all, 0.02, 0.98);
  }

  const std::vector<double>& squares_;
  double floor_;
  std::vector<double> small_;
};

}  // namespace

LatentVariance fit_latent_variance(std::span<const float> residuals, double floor) {
  LatentVariance result;
  result.precision.assign(residuals.size(), 1);
  const std::vector<double> squares = squares_of(residuals);
  const double mean = mean_of(squares);
  double fourth = 0;
  for (const double square : squares) fourth += square * square;
  fourth /= static_cast<double>(std::max<std::size_t>(1, squares.size()));
  result.kurtosis = mean > 0 ? fourth / (mean * mean) : 3;
  if (!(result.kurtosis > kHeavyTails) || mean < kLeastMeanSquare) return result;
  Mixture mixture(squares, floor);
  mixture.fit();
  result.impulsive = true;
  result.small_variance = mixture.variance1;
  result.large_variance = mixture.variance2;
  result.small_share = mixture.share;
  result.relative_variance.resize(residuals.size());
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const double p = mixture.small(i);
    result.precision[i] = static_cast<float>(mean * (p / mixture.variance1 + (1 - p) / mixture.variance2));
    result.relative_variance[i] = static_cast<float>((p * mixture.variance1 + (1 - p) * mixture.variance2) / mean);
  }
  return result;
}

}  // namespace crease
