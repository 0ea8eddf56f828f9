#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "core/mesh/mesh.h"

namespace crease {

/// The unit normal of the triangle a, b, c times twice its area.
inline Vec3 area_vector(const Vec3& a, const Vec3& b, const Vec3& c) { return (b - a).cross(c - a); }

inline Vec3 area_vector(const std::vector<Vec3>& positions, const Triangle& triangle) {
  return area_vector(positions[triangle[0]], positions[triangle[1]], positions[triangle[2]]);
}

inline Vec3 centroid(const std::vector<Vec3>& positions, const Triangle& triangle) {
  return (positions[triangle[0]] + positions[triangle[1]] + positions[triangle[2]]) / 3;
}

/// The unit vector along `vector`, or zero if it is too short to have a direction.
inline Vec3 direction(const Vec3& vector) {
  constexpr double kNoLength = 1e-12;
  const double length = vector.norm();
  return length > kNoLength ? Vec3(vector / length) : Vec3::Zero();
}

}  // namespace crease
