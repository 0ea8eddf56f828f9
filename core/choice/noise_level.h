#pragma once

#include "core/base/thread_team.h"
#include "core/geometry/surface.h"

namespace crease {

/// What an upload says of its noise at first sight. Lengths in ℓ.
struct NoiseLevel {
  double sigma = 0;             ///< along the normals
  double sigma_tangential = 0;  ///< within the surface, in each direction; irregular sampling counts as such
  double tangential_tail = 0;   ///< 0.9 quantile of the squares that it is the median of, over that: 3.3 for Gaussians
  double folded_share = 0;      ///< of faces that look against the smoothed normals around them
};

/// Noise along the normals from the residuals of quadrics fitted to two-rings (at most 4,000, evenly picked): the
/// pooled variance of the fits that one level of noise explains. Noise within the surface from how far vertices lie
/// from the mean of their neighbours.
NoiseLevel estimate_noise_level(const Surface& surface, ThreadTeam& team);

}  // namespace crease
