#include "core/smooth/field.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

#include "core/smooth/potential.h"
#include "core/smooth/ridge_straightness.h"

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

/// The angle as the edge process sees it: negative, and so never sharp enough, for an edge that may be no ridge.
double clamped_angle(double dihedral, const EnergyModel& model) {
  const double angle = std::abs(dihedral);
  const bool may_be_ridge =
      angle <= model.sharpness_limit &&
      (model.ridge_kind == RidgeKind::kAll || (model.ridge_kind == RidgeKind::kConvex) == (dihedral > 0));
  return may_be_ridge ? angle : -angle;
}

std::vector<Triangle> oriented_faces(const Mesh& mesh, const Topology& topology) {
  std::vector<Triangle> faces(mesh.triangles.size());
  for (std::size_t f = 0; f < faces.size(); ++f) faces[f] = oriented(mesh, topology, f);
  return faces;
}

std::vector<Vec3> relative_positions(const std::vector<Vec3>& positions, const Vec3& origin, double unit) {
  std::vector<Vec3> result;
  result.reserve(positions.size());
  for (const Vec3& position : positions) result.push_back((position - origin) / unit);
  return result;
}

/// Whether walking an edge from its first vertex to its second has `face` on its left.
bool runs_along(const Triangle& face, const Edge& edge) {
  return (face[0] == edge.v0 && face[1] == edge.v1) || (face[1] == edge.v0 && face[2] == edge.v1) ||
         (face[2] == edge.v0 && face[0] == edge.v1);
}

}  // namespace

EnergyModel EnergyModel::final_of(const MrfOptions& options) {
  EnergyModel model{options.likelihood_weight,   options.smoothness_weight, options.sharpness_weight,
                    options.sharpness_threshold, options.support_weight,    options.smoothness};
  model.smoothness_width = static_cast<float>(2 * std::sin(options.smoothness_width / 2));
  model.curvature_weight = options.curvature_weight;
  model.continuity_weight = options.continuity_weight;
  model.ridge_line_weight = options.ridge_line_weight;
  model.ridge_kind = options.ridge_kind;
  model.sharpness_limit = options.sharpness_limit;
  return model;
}

Field::Field(const Mesh& mesh, const Topology& mesh_topology, const MrfOptions& options,
             std::span<const double> weights)
    : topology(mesh_topology),
      unit(mean_edge_length(mesh.positions, topology.edges)),
      origin(mesh.positions[mesh.triangles.front()[0]]),
      faces(oriented_faces(mesh, topology)),
      measured(relative_positions(mesh.positions, origin, unit)),
      positions(measured),
      normals(faces.size()),
      labels(topology.edges.size(), 0),
      likelihood(measured, faces, options, weights),
      second_difference(measured, faces, topology) {
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

void EdgeTerms::update(const Field& field, const EnergyModel& model, ThreadTeam& team) {
  const Topology& topology = field.topology;
  const std::size_t edge_count = topology.edges.size();
  potential.assign(edge_count, 0);
  dihedral.assign(edge_count, 0);
  angle.assign(edge_count, 0);
  direction.resize(edge_count);
  team.run(edge_count, kBlock, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t e = begin; e < end; ++e) {
      const Edge& edge = topology.edges[e];
      const Vec3 along = field.positions[edge.v1] - field.positions[edge.v0];
      const double length = along.norm();
      direction[e] = length > 0 ? Vec3(along / length) : Vec3::Zero();
      if (!topology.is_interior(e)) continue;
      const auto [f0, f1] = topology.edge_faces[e];
      const UnitNormal& n0 = field.normals[f0];
      const UnitNormal& n1 = field.normals[f1];
      const double difference = static_cast<double>((n0 - n1).squaredNorm());
      potential[e] = smoothness_potential(model.smoothness, difference, model.smoothness_width);
      if (n0.isZero(0) || n1.isZero(0)) continue;
      const Vec3 turning = n0.head<3>().cross(n1.head<3>()).cast<double>();
      const bool convex = (turning.dot(along) >= 0) == runs_along(field.faces[f0], edge);
      dihedral[e] = convex ? angle_of_chord(difference) : -angle_of_chord(difference);
      angle[e] = clamped_angle(dihedral[e], model);
    }
  });
  if (model.curvature_weight > 0) {
    curvature.resize(field.faces.size());
    team.run(curvature.size(), kBlock, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t f = begin; f < end; ++f) {
        curvature[f] = field.second_difference.square(field, static_cast<Index>(f));
      }
    });
  }
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

double continuity_slope(const Field& field, const EdgeTerms& terms, Index edge) {
  const Topology& topology = field.topology;
  double slope = 0;
  for (const Index vertex : {topology.edges[edge].v0, topology.edges[edge].v1}) {
    for (const Index other : topology.vertex_edges[vertex]) {
      if (other == edge || field.labels[other] == 0) continue;
      const bool both_out = (topology.edges[edge].v0 == vertex) == (topology.edges[other].v0 == vertex);
      const double cosine = terms.direction[edge].dot(terms.direction[other]);
      const double cos_turning = both_out ? -cosine : cosine;
      if (cos_turning <= 0) continue;
      const double change = terms.dihedral[edge] - terms.dihedral[other];
      slope += cos_turning * field.labels[other] * change * change;
    }
  }
  return slope;
}

Energy energy(const Field& field, const EdgeTerms& terms, const EnergyModel& model, ThreadTeam& team) {
  const Topology& topology = field.topology;
  Energy result;
  result.likelihood = model.likelihood_weight * block_sum<double>(field.positions.size(), team, [&](std::size_t v) {
                        return field.likelihood.energy(field, static_cast<Index>(v));
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
  if (model.curvature_weight > 0) {
    result.curvature = model.curvature_weight * block_sum<double>(field.faces.size(), team, [&](std::size_t f) {
                         return SecondDifference::gate(field, static_cast<Index>(f)) * terms.curvature[f];
                       });
  }
  if (model.continuity_weight > 0) {
    // Every pair is met from both of its edges.
    result.continuity =
        model.continuity_weight / 2 * block_sum<double>(topology.edges.size(), team, [&](std::size_t e) {
          return field.labels[e] * continuity_slope(field, terms, static_cast<Index>(e));
        });
  }
  if (model.ridge_line_weight > 0) {
    const RidgeStraightness lines(field, team);
    result.ridge_line = model.ridge_line_weight * block_sum<double>(field.positions.size(), team, [&](std::size_t v) {
                          return lines.energy(field, static_cast<Index>(v));
                        });
  }
  return result;
}

Energy energy(const Field& field, const EnergyModel& model) {
  ThreadTeam alone(1);
  EdgeTerms terms;
  terms.update(field, model, alone);
  return energy(field, terms, model, alone);
}

}  // namespace crease
