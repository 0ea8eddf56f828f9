#include "core/smooth/second_difference.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "core/smooth/field.h"

namespace crease {
namespace {

/// Where the centroids of a face's neighbours are too badly placed to interpolate at its own.
constexpr double kSmallestWeight = 0.05;

Index across(const Topology& topology, Index face, Index edge) {
  const auto [f0, f1] = topology.edge_faces[edge];
  return f0 == face ? f1 : f0;
}

bool is_inside(const Topology& topology, Index face) {
  return std::ranges::all_of(topology.face_edges[face],
                             [&](Index edge) { return edge != kNone && topology.is_interior(edge); });
}

/// Of `point` in the triangle, as far as its plane goes; a third each where a corner would weigh next to nothing.
std::array<float, 3> barycentric(const Vec3& point, const std::array<Vec3, 3>& corners) {
  const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  std::array<float, 3> weights{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 opposite = (corners[(k + 1) % 3] - point).cross(corners[(k + 2) % 3] - point);
    const double weight = opposite.dot(normal) / normal.squaredNorm();
    if (!(weight > kSmallestWeight)) return {1.0F / 3, 1.0F / 3, 1.0F / 3};
    weights[k] = static_cast<float>(weight);
  }
  return weights;
}

}  // namespace

SecondDifference::SecondDifference(const std::vector<Vec3>& positions, const std::vector<Triangle>& faces,
                                   const Topology& topology)
    : weights_(faces.size(), {0, 0, 0}) {
  const auto centroid = [&](Index face) {
    const auto [a, b, c] = faces[face];
    return Vec3((positions[a] + positions[b] + positions[c]) / 3);
  };
  for (Index face = 0; face < faces.size(); ++face) {
    if (!is_inside(topology, face)) continue;
    std::array<Vec3, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) corners[k] = centroid(across(topology, face, topology.face_edges[face][k]));
    weights_[face] = barycentric(centroid(face), corners);
  }
}

Index SecondDifference::neighbor(const Field& field, Index face, std::size_t k) {
  return across(field.topology, face, field.topology.face_edges[face][k]);
}

double SecondDifference::square(const Field& field, Index face) const {
  return static_cast<double>(
      of(field, face, [&](Index f) -> const UnitNormal& { return field.normals[f]; }).squaredNorm());
}

double SecondDifference::weight(const Field& field, Index face, Index edge) const {
  const auto& edges = field.topology.face_edges[face];
  const auto k = static_cast<std::size_t>(std::ranges::find(edges, edge) - edges.begin());
  return static_cast<double>(weights_[face][k]);
}

double SecondDifference::gate(const Field& field, Index face, Index except) {
  double gate = 1;
  for (const Index edge : field.topology.face_edges[face]) {
    if (edge != kNone && edge != except) gate *= 1 - field.labels[edge];
  }
  return gate;
}

double SecondDifference::change(const Field& field, const Moved& moved) const {
  const auto normal_after = [&](Index face) -> UnitNormal {
    const auto found = std::ranges::find(moved, face, &Moved::value_type::first);
    return found != moved.end() ? found->second : field.normals[face];
  };
  std::vector<Index> affected;
  for (const auto& [face, normal] : moved) {
    affected.push_back(face);
    for (const Index edge : field.topology.face_edges[face]) {
      if (edge != kNone && field.topology.is_interior(edge)) affected.push_back(across(field.topology, face, edge));
    }
  }
  std::ranges::sort(affected);
  affected.erase(std::unique(affected.begin(), affected.end()), affected.end());
  double change = 0;
  for (const Index face : affected) {
    const auto after = static_cast<double>(of(field, face, normal_after).squaredNorm());
    change += gate(field, face) * (after - square(field, face));
  }
  return change;
}

}  // namespace crease
