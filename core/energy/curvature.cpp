#include "core/energy/curvature.h"

#include <algorithm>
#include <utility>

#include "core/energy/points.h"

namespace crease {
namespace {

/// Where the centroids of a face's neighbours are too badly placed to interpolate at its own.
constexpr double kSmallestWeight = 0.05;

bool is_inside(const Topology& topology, Index face) {
  return std::ranges::all_of(topology.face_edges[face],
                             [&](Index edge) { return topology.face_across(face, edge) != kNone; });
}

/// Of `point` in the triangle, as far as its plane goes; a third each where a corner would weigh next to nothing.
std::array<float, 3> barycentric(const Vec3& point, const std::array<Vec3, 3>& corners) {
  const Vec3 normal = area_vector(corners[0], corners[1], corners[2]);
  std::array<float, 3> weights{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 opposite = area_vector(point, corners[(k + 1) % 3], corners[(k + 2) % 3]);
    const double weight = opposite.dot(normal) / normal.squaredNorm();
    if (!(weight > kSmallestWeight)) return {1.0F / 3, 1.0F / 3, 1.0F / 3};
    weights[k] = static_cast<float>(weight);
  }
  return weights;
}

/// The field's normals but for a few faces.
struct MovedNormals {
  using Vector = UnitNormal;
  const Field& field;
  std::vector<std::pair<Index, UnitNormal>> moved;

  const UnitNormal& operator()(Index face) const {
    const auto found = std::ranges::find(moved, face, &std::pair<Index, UnitNormal>::first);
    return found != moved.end() ? found->second : field.normals[face];
  }
};

}  // namespace

CurvatureTerm::CurvatureTerm(const TermSetup& setup)
    : topology_(setup.field.topology),
      weights_(setup.field.faces.size(), {0, 0, 0}),
      squares_(setup.field.faces.size(), 0),
      gates_(setup.field.faces.size(), 1) {
  const Surface& surface = setup.field;
  for (Index face = 0; face < weights_.size(); ++face) {
    if (!is_inside(topology_, face)) continue;
    std::array<Vec3, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) corners[k] = centroid(surface.measured, surface.faces[neighbor(face, k)]);
    weights_[face] = barycentric(centroid(surface.measured, surface.faces[face]), corners);
  }
}

double CurvatureTerm::gate(const Field& field, Index face, Index except) const {
  double gate = 1;
  for (const Index edge : topology_.face_edges[face]) {
    if (edge != kNone && edge != except) gate *= 1 - field.labels[edge];
  }
  return gate;
}

void CurvatureTerm::positions_changed(const Field& field, ThreadTeam& team) {
  team.run(squares_.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t f = begin; f < end; ++f) {
      squares_[f] = static_cast<double>(second_difference(FieldNormals{field}, static_cast<Index>(f)).squaredNorm());
    }
  });
}

void CurvatureTerm::labels_changed(const Field& field, ThreadTeam& team) {
  team.run(gates_.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t f = begin; f < end; ++f) gates_[f] = gate(field, static_cast<Index>(f));
  });
}

double CurvatureTerm::energy(const Field& field, ThreadTeam& team) const {
  return block_sum<double>(squares_.size(), team,
                           [&](std::size_t f) { return gate(field, static_cast<Index>(f)) * squares_[f]; });
}

double CurvatureTerm::slope(const Field& field, Index edge) const {
  double slope = 0;
  for (const Index face : topology_.edge_faces[edge]) slope -= gate(field, face, edge) * squares_[face];
  return slope;
}

double CurvatureTerm::change(const Field& field, const VertexMove& move) const {
  MovedNormals after{field, {}};
  std::vector<Index> affected;
  move.for_each_face([&](Index face, const UnitNormal& normal) {
    after.moved.emplace_back(face, normal);
    affected.push_back(face);
    field.visit_face_neighbors(face, [&](Index other) { affected.push_back(other); });
  });
  std::ranges::sort(affected);
  affected.erase(std::unique(affected.begin(), affected.end()), affected.end());
  double change = 0;
  for (const Index face : affected) {
    const auto now = static_cast<double>(second_difference(FieldNormals{field}, face).squaredNorm());
    change += gates_[face] * (static_cast<double>(second_difference(after, face).squaredNorm()) - now);
  }
  return change;
}

}  // namespace crease
