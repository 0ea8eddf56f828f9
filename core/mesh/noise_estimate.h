#pragma once

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// Estimates the standard deviation, over all vertices, of the noise along the surface normal, in mean edge lengths of
/// the surface without the noise. 0 when no neighbourhood is large enough to tell noise from shape.
///
/// Around each vertex (at most 20,000 of them, evenly picked) a quadric is fitted to the heights of the vertices up to
/// two edges away, over the plane across their vector area. The residual sum of squares over its degrees of freedom is
/// unbiased for the noise variance wherever the noise-free surface is a quadric, whatever the distribution of the
/// noise: also when half of the vertices do not move. Neighbourhoods across ridges stand out and are left out.
/// Edge lengths are taken within those planes, so that noise along normals does not lengthen the unit. Noise that
/// moves vertices within the surface does: isotropic noise is estimated low, by a tenth at 0.3 and a third at 0.7.
double estimate_noise_sigma(const Mesh& mesh, const Topology& topology);

}  // namespace crease
