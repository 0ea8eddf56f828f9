#include "core/energy/field.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace crease {
namespace {

/// Angle between unit vectors by the square of their difference, which is exact where a cosine is not: near zero.
/// arccos x = sqrt(1 − x) times a polynomial, within 2·10⁻⁸ rad [Abramowitz & Stegun 4.4.46].
double angle_of_chord(double square) {
  const double cosine = 1 - square / 2;
  const double x = std::min(std::abs(cosine), 1.0);
  double p = -0.0012624911;
  for (const double coefficient :
       {0.0066700901, -0.0170881256, 0.0308918810, -0.0501743046, 0.0889789874, -0.2145988016, 1.5707963050}) {
    p = p * x + coefficient;
  }
  return cosine < 0 ? std::numbers::pi - std::sqrt(1 - x) * p : std::sqrt(square / 2) * p;
}

/// Whether walking an edge from its first vertex to its second has `face` on its left.
bool runs_along(const Triangle& face, const Edge& edge) {
  return (face[0] == edge.v0 && face[1] == edge.v1) || (face[1] == edge.v0 && face[2] == edge.v1) ||
         (face[2] == edge.v0 && face[0] == edge.v1);
}

}  // namespace

Field::Field(const Mesh& mesh, const Topology& mesh_topology)
    : Surface(mesh, mesh_topology),
      normals(faces.size()),
      labels(topology.edges.size(), 0),
      edges{std::vector<double>(labels.size(), 0), std::vector<double>(labels.size(), 0),
            std::vector<Vec3>(labels.size(), Vec3::Zero())} {
  for (std::size_t f = 0; f < faces.size(); ++f) normals[f] = face_normal(f);
}

UnitNormal Field::face_normal(std::size_t face) const {
  const Vec3 area = area_vector(face);
  UnitNormal normal = UnitNormal::Zero();
  normal.head<3>() = (area * (1 / std::sqrt(area.squaredNorm() + static_cast<double>(kNoArea)))).cast<float>();
  return normal;
}

void Field::update_normals(ThreadTeam& team) {
  team.run(faces.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t f = begin; f < end; ++f) normals[f] = face_normal(f);
  });
}

void Field::update_edges(ThreadTeam& team, bool with_angles) {
  team.run(labels.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t e = begin; e < end; ++e) {
      const bool interior = topology.is_interior(e);
      if (interior) {
        const auto [f0, f1] = topology.edge_faces[e];
        edges.chord[e] = static_cast<double>((normals[f0] - normals[f1]).squaredNorm());
      }
      if (!with_angles) continue;
      const Edge& edge = topology.edges[e];
      const Vec3 along = positions[edge.v1] - positions[edge.v0];
      const double length = along.norm();
      edges.direction[e] = length > 0 ? Vec3(along / length) : Vec3::Zero();
      if (interior) edges.angle[e] = signed_angle(e, along);
    }
  });
}

/// The angle of an interior edge that runs `along`; 0 at faces without area.
double Field::signed_angle(std::size_t edge, const Vec3& along) const {
  const auto [f0, f1] = topology.edge_faces[edge];
  const UnitNormal &n0 = normals[f0], &n1 = normals[f1];
  if (n0.isZero(0) || n1.isZero(0)) return 0;
  const Vec3 turning = n0.head<3>().cross(n1.head<3>()).cast<double>();
  const bool convex = (turning.dot(along) >= 0) == runs_along(faces[f0], topology.edges[edge]);
  const double angle = angle_of_chord(edges.chord[edge]);
  return convex ? angle : -angle;
}

}  // namespace crease
