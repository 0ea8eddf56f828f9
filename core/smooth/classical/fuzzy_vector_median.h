#pragma once

#include <span>

#include "core/mesh/mesh.h"

namespace crease {

/// The fuzzy vector median of unit normals [Shen & Barner 2004]: the mean, weighted by a Gaussian membership
/// function of `width` in the distance to the vector median, which is the one of them with the least sum of distances
/// to all. Distances are chords of the unit sphere, radians for small angles. Zero vectors do not count; of nothing
/// else it is zero.
Vec3 fuzzy_vector_median(std::span<const Vec3> normals, double width);

}  // namespace crease
