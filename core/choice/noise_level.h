#pragma once

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

/// What an upload says of its noise at first sight. Lengths in ℓ.
struct NoiseLevel {
  double sigma = 0;             ///< along the normals
  double sigma_tangential = 0;  ///< within the surface, in each direction; irregular sampling counts as such
  double tangential_tail = 0;   ///< 0.9 quantile of the squares that it is the median of, over that: 3.3 for Gaussians
  double folded_share = 0;      ///< of faces that look against the smoothed normals around them
  LoneImpulses impulses;
};

/// Noise along the normals from the residuals of quadrics fitted to two-rings (at most 4,000, evenly picked): the
/// pooled variance of the fits that one level of noise explains. Noise within the surface from how far vertices lie
/// from the mean of their neighbours.
NoiseLevel estimate_noise_level(const Surface& surface, ThreadTeam& team);

}  // namespace crease
