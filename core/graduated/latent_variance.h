#pragma once

#include <span>
#include <vector>

namespace crease {

/// Residuals as a mixture of two zero-mean Gaussians: noise that leaves a part of the vertices (nearly) alone.
struct LatentVariance {
  bool impulsive = false;
  double kurtosis = 3;
  double small_variance = 0, large_variance = 0, small_share = 0;
  std::vector<float> precision;          ///< per residual, relative to one over the mean square; 1 if not impulsive
  std::vector<float> relative_variance;  ///< expected variance over the mean square; empty if not impulsive
};

/// Fits the mixture by expectation maximisation if the residuals' kurtosis exceeds 3.8. `floor` is the least variance.
LatentVariance fit_latent_variance(std::span<const float> residuals, double floor);

}  // namespace crease
