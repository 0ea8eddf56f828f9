#include "core/choice/capture.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace crease {
namespace {

double share(std::size_t part, std::size_t whole) {
  return static_cast<double>(part) / static_cast<double>(std::max<std::size_t>(1, whole));
}

double share_of_exact_flats(const Surface& surface) {
  constexpr double kFlat = 1e-4;  // radians
  std::size_t flat = 0, inner = 0;
  for (std::size_t e = 0; e < surface.topology.edges.size(); ++e) {
    if (!surface.topology.is_interior(e)) continue;
    const auto [first, second] = surface.topology.edge_faces[e];
    const Vec3 a = surface.area_vector(first), b = surface.area_vector(second);
    ++inner;
    if (a.cross(b).norm() < kFlat * a.dot(b)) ++flat;
  }
  return share(flat, inner);
}

double share_facing_one_side(const Surface& surface) {
  constexpr double kLeastSide = 0.05;  ///< of the area; less is the rounding, or a hole, of what is closed
  Vec3 sum = Vec3::Zero();
  for (std::size_t f = 0; f < surface.faces.size(); ++f) sum += surface.area_vector(f);
  double facing = 0, whole = 0;
  for (std::size_t f = 0; f < surface.faces.size(); ++f) {
    const Vec3 area = surface.area_vector(f);
    whole += area.norm();
    if (area.dot(sum) > 0) facing += area.norm();
  }
  return sum.norm() > kLeastSide * whole ? facing / whole : 0.5;
}

double share_of_regular_vertices(const Surface& surface) {
  std::vector<std::uint32_t> faces(surface.measured.size());
  for (const Triangle& face : surface.faces) {
    for (const Index v : face) ++faces[v];
  }
  return share(static_cast<std::size_t>(std::ranges::count(faces, 6U)), faces.size());
}

}  // namespace

bool CaptureSigns::is_one_view() const {
  constexpr double kMostFaces = 0.85;  ///< what is steep seems to look away where the noise is strong
  constexpr double kMostVertices = 0.5;
  return facing > kMostFaces && regular > kMostVertices;
}

CaptureSigns capture_signs(const Surface& surface) {
  return {share_of_exact_flats(surface), share_facing_one_side(surface), share_of_regular_vertices(surface)};
}

}  // namespace crease
