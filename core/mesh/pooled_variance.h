#pragma once

#include <vector>

namespace crease {

/// The variance of residuals about a fit, Σ residual² / freedom.
struct FitVariance {
  double variance = 0;
  double freedom = 0;  ///< degrees of freedom: observations less parameters
};

/// The pooled variance of the fits that one level of noise explains: from the median, leaves out what is too large to
/// be chance and pools again, until the choice stands. At least one fit.
double pooled_variance(const std::vector<FitVariance>& fits);

}  // namespace crease
