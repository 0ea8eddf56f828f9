#include "core/mesh/pooled_variance.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace crease {
namespace {

constexpr double kOutlierDeviations = 2.5;
constexpr int kPoolingRounds = 100;

/// The value that χ²/ν exceeds as rarely as a standard normal exceeds `z` [Wilson & Hilferty 1931].
double chi_squared_quantile(double z, double freedom) {
  const double c = 2 / (9 * freedom);
  return std::pow(1 - c + z * std::sqrt(c), 3);
}

}  // namespace

double pooled_variance(const std::vector<FitVariance>& fits) {
  std::vector<double> variances;
  variances.reserve(fits.size());
  for (const FitVariance& fit : fits) variances.push_back(fit.variance / chi_squared_quantile(0, fit.freedom));
  const auto middle = variances.begin() + static_cast<std::ptrdiff_t>(variances.size() / 2);
  std::nth_element(variances.begin(), middle, variances.end());
  double pooled = *middle;
  for (int round = 0; round < kPoolingRounds; ++round) {
    double sum = 0, freedom = 0;
    for (const FitVariance& fit : fits) {
      if (fit.variance > pooled * chi_squared_quantile(kOutlierDeviations, fit.freedom)) continue;
      sum += fit.variance * fit.freedom;
      freedom += fit.freedom;
    }
    const double before = std::exchange(pooled, sum / freedom);
    if (std::abs(pooled - before) <= 1e-6 * before) break;
  }
  return pooled;
}

}  // namespace crease
