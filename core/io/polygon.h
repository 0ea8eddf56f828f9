#pragma once

#include <span>
#include <vector>

#include "core/mesh/mesh.h"

namespace crease {

/// A polygon with more corners stays a fan: the time that its triangulation takes grows with the square of them.
inline constexpr std::size_t kMostCornersToTile = 20'000;

/// Triangles that tile a polygon, given as the fan around its first corner, in place. The polygon may be concave and
/// need not be quite planar; it is seen along its vector area. A fan that tiles the polygon stays as it is. Returns
/// false if the polygon stays a fan although that does not tile it: it crosses itself, has no area or is too large.
bool tile_polygon(const std::vector<Vec3>& positions, std::span<Triangle> fan);

}  // namespace crease
