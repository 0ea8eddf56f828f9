#include "core/smooth/field.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

namespace crease {
namespace {

constexpr std::size_t kBlock = 4096;

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

struct EdgeSums {
  double smoothness = 0, sharpness = 0;
  EdgeSums& operator+=(const EdgeSums& other) {
    smoothness += other.smoothness;
    sharpness += other.sharpness;
    return *this;
  }
};

}  // namespace

EnergyModel EnergyModel::final_of(const SmoothOptions& options) {
  return {options.likelihood_weight,   options.smoothness_weight, options.sharpness_weight,
          options.sharpness_threshold, options.support_weight,    options.smoothness};
}

Field::Field(const Mesh& mesh, const Topology& mesh_topology) : topology(mesh_topology) {
  unit = mean_edge_length(mesh.positions, topology.edges);
  origin = mesh.positions[mesh.triangles.front()[0]];
  faces.resize(mesh.triangles.size());
  for (std::size_t f = 0; f < faces.size(); ++f) faces[f] = oriented(mesh, topology, f);
  measured.reserve(mesh.positions.size());
  for (const Vec3& position : mesh.positions) measured.push_back((position - origin) / unit);
  positions = measured;
  labels.assign(topology.edges.size(), 0);
  normals.resize(faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) normals[f] = face_normal(f);
}

UnitNormal Field::face_normal(std::size_t face) const {
  const auto [a, b, c] = faces[face];
  const Vec3 cross = (positions[b] - positions[a]).cross(positions[c] - positions[a]);
  UnitNormal normal = UnitNormal::Zero();
  normal.head<3>() = (cross * (1 / std::sqrt(cross.squaredNorm() + static_cast<double>(kNoArea)))).cast<float>();
  return normal;
}

void Field::update_normals(ThreadTeam& team) {
  team.run(faces.size(), kBlock, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t f = begin; f < end; ++f) normals[f] = face_normal(f);
  });
}

std::vector<Vec3> Field::upload_positions(const Mesh& mesh) const {
  std::vector<Vec3> result(mesh.positions);
  for (std::size_t v = 0; v < result.size(); ++v) {
    if (positions[v] != measured[v]) result[v] = positions[v] * unit + origin;
  }
  return result;
}

void EdgeTerms::update(const Field& field, Smoothness smoothness, ThreadTeam& team) {
  const Topology& topology = field.topology;
  const std::size_t edge_count = topology.edges.size();
  potential.assign(edge_count, 0);
  angle.assign(edge_count, 0);
  direction.resize(edge_count);
  team.run(edge_count, kBlock, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t e = begin; e < end; ++e) {
      const Vec3 along = field.positions[topology.edges[e].v1] - field.positions[topology.edges[e].v0];
      const double length = along.norm();
      direction[e] = length > 0 ? Vec3(along / length) : Vec3::Zero();
      if (!topology.is_interior(e)) continue;
      const UnitNormal& n0 = field.normals[topology.edge_faces[e][0]];
      const UnitNormal& n1 = field.normals[topology.edge_faces[e][1]];
      const double difference = static_cast<double>((n0 - n1).squaredNorm());
      potential[e] = smoothness_potential(smoothness, difference);
      if (!n0.isZero(0) && !n1.isZero(0)) angle[e] = angle_of_chord(difference);
    }
  });
  label_sum.resize(field.positions.size());
  team.run(label_sum.size(), kBlock, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t v = begin; v < end; ++v) {
      Vec3 sum = Vec3::Zero();
      for (const Index e : topology.vertex_edges[v]) {
        sum += (topology.edges[e].v0 == v ? field.labels[e] : -field.labels[e]) * direction[e];
      }
      label_sum[v] = sum;
    }
  });
}

Energy energy(const Field& field, const EdgeTerms& terms, const EnergyModel& model, ThreadTeam& team) {
  const Topology& topology = field.topology;
  Energy result;
  result.likelihood = model.likelihood_weight * block_sum<double>(field.positions.size(), team, [&](std::size_t v) {
                        return (field.positions[v] - field.measured[v]).squaredNorm();
                      });
  const auto sums = block_sum<EdgeSums>(topology.edges.size(), team, [&](std::size_t e) {
    const double label = field.labels[e];
    return EdgeSums{(1 - label) * terms.potential[e], (model.sharpness_threshold - terms.angle[e]) * label};
  });
  result.smoothness = model.smoothness_weight * sums.smoothness;
  result.sharpness = model.sharpness_weight * sums.sharpness;

  // Σ over pairs at a vertex of u·u' ε ε' is half of |Σ u ε|² − Σ ε²|u|².
  const double squares =
      block_sum<double>(terms.label_sum.size(), team, [&](std::size_t v) { return terms.label_sum[v].squaredNorm(); }) -
      2 * block_sum<double>(topology.edges.size(), team, [&](std::size_t e) {
        return field.labels[e] * field.labels[e] * terms.direction[e].squaredNorm();
      });
  result.support = model.sharpness_weight * model.support_weight * squares / 2;
  return result;
}

Energy energy(const Field& field, const EnergyModel& model) {
  ThreadTeam alone(1);
  EdgeTerms terms;
  terms.update(field, model.smoothness, alone);
  return energy(field, terms, model, alone);
}

}  // namespace crease
