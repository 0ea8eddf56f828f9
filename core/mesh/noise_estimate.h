#pragma once

#include "core/base/thread_team.h"
#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// Estimates the standard deviation of the noise along the surface normal over all vertices, in units of the mean edge
/// length of the noise-free surface. Returns 0 if no neighbourhood is large enough to separate noise from shape.
///
/// The method fits a quadric around each vertex, or around 20,000 evenly chosen ones of a larger mesh. It fits the
/// heights of the vertices up to two edges away over the plane that is normal to their vector area. The residual sum of
/// squares, divided by its degrees of freedom, is an unbiased estimate of the noise variance if the noise-free surface
/// is a quadric. The distribution of the noise does not matter; half of the vertices may have none. Neighbourhoods
/// across ridges are outliers and are dropped.
///
/// Edge lengths are measured in the fitted planes, so that noise along normals does not increase the unit. Tangential
/// noise does: the estimate for isotropic noise is a tenth too low at 0.3, and a third too low at 0.7.
double estimate_noise_sigma(const Mesh& mesh, const Topology& topology, ThreadTeam& team = calling_thread());

}  // namespace crease
