#pragma once

#include <array>

#include "core/base/thread_team.h"
#include "core/geometry/surface.h"

namespace crease {

/// Vertices that stand out alone: far from the mean of their neighbours, which lie where theirs say once the vertex is
/// out of the way. Neither shapes nor Gaussian noise have more than a few; impulsive noise that spares most vertices
/// does.
struct LoneImpulses {
  double share = 0;  ///< of the inner vertices
  double rms = 0;    ///< how far they stand out
};

/// How vertices lie within the surface, beside the means of their neighbours. Noise in all directions shows here; so
/// does irregular sampling.
struct WithinSurface {
  static constexpr std::array<double, 4> kShares{0.1, 0.25, 0.75, 0.9};

  double sigma = 0;  ///< in each direction, as noise would have it
  /// Quantiles of the squares at kShares, over the median: 0.15, 0.42, 2 and 3.3 for Gaussians.
  std::array<double, kShares.size()> quantiles{};
  /// Correlation of the ways from the means at both ends of an edge: −0.24 for noise on a regular mesh.
  double alikeness = 0;

  double tail() const { return quantiles.back(); }
};

/// What an upload says of its noise at first sight. Lengths in ℓ.
struct NoiseLevel {
  double sigma = 0;  ///< along the normals
  WithinSurface within;
  double folded_share = 0;  ///< of faces that look against the smoothed normals around them
  LoneImpulses impulses;

  bool has_folds() const { return folded_share >= 0.02; }  ///< more than hardly any
};

/// Noise along the normals from the residuals of quadrics fitted to two-rings (at most 4,000, evenly picked): the
/// pooled variance of the fits that one level of noise explains. Noise within the surface from how far vertices lie
/// from the mean of their neighbours.
NoiseLevel estimate_noise_level(const Surface& surface, ThreadTeam& team);

}  // namespace crease
