#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "core/energy/term.h"
#include "core/energy/vertex_move.h"

namespace crease {

/// Σ_v w_v U_L(v): how improbable the measured positions are, given the positions v (§3.1).
class LikelihoodTerm {
 public:
  static constexpr std::string_view kName = "likelihood";
  static constexpr int kField = 1;
  static double weight(const MrfOptions& options) { return options.likelihood_weight; }
  /// The weight is annealed, and either end of its schedule may be 0.
  static bool is_used(const MrfOptions& options) {
    return options.likelihood_weight > 0 || options.likelihood_weight_start > 0;
  }
  static Neighborhood neighborhood(const MrfOptions& options) {
    return options.likelihood == LikelihoodKind::kVolume ? Neighborhood::kWide : Neighborhood::kFirstOrder;
  }
  explicit LikelihoodTerm(const TermSetup& setup);

  double energy(const Field& field, ThreadTeam& team) const;
  double change(const Field& field, const VertexMove& move) const {
    if (kind_ != LikelihoodKind::kQuadratic) return general_change(field, move.vertex(), move.to());
    const Vec3& measured = field.measured[move.vertex()];
    return weights_[move.vertex()] *
           ((move.to() - measured).squaredNorm() - (field.positions[move.vertex()] - measured).squaredNorm());
  }

  /// w_v U_L(v) at `points(v)`.
  template <typename Points>
  auto at_positions(const Points& points, Index vertex) const;
  template <typename Points>
  auto by_position(const Points& points, Index vertex) const;

 private:
  /// The volume swept by a vertex and its neighbours, and the area that swept it.
  template <typename Real>
  struct Flow {
    Real volume = 0, area = 0;
    Real square() const { return area > 0 ? volume * volume / (area * area) : 0; }
  };

  /// The part of U_L that depends on the displacement of the vertex alone, and its derivative.
  template <typename Vector>
  typename Vector::Scalar alone(Index vertex, const Vector& displacement) const;
  template <typename Vector>
  Vector alone_by_displacement(Index vertex, const Vector& displacement) const;
  template <typename Points>
  auto flow(const Points& points, Index vertex) const;
  /// Calls `visit(v)` for the vertex and its neighbours.
  template <typename Visit>
  void visit_neighborhood(Index vertex, Visit visit) const;
  double general_change(const Field& field, Index vertex, const Vec3& to) const;
  double flow_change(const Field& field, Index vertex, const Vec3& step) const;
  Vec3 noise_direction(Index vertex) const { return fixed_direction_ ? *fixed_direction_ : vertex_normals_[vertex]; }

  const Topology& topology_;
  const std::vector<Vec3>& measured_;
  LikelihoodKind kind_;
  double width_, across_, volume_weight_;
  std::vector<double> weights_;
  std::optional<Vec3> fixed_direction_;
  std::vector<Vec3> vertex_areas_;    ///< a third of the sum of the area vectors at the vertex
  std::vector<Vec3> vertex_normals_;  ///< the same, normalised
};

template <typename Vector>
typename Vector::Scalar LikelihoodTerm::alone(Index vertex, const Vector& displacement) const {
  using Real = typename Vector::Scalar;
  const Real square = displacement.squaredNorm();
  switch (kind_) {
    case LikelihoodKind::kQuadratic:
    case LikelihoodKind::kVolume:
      return square;
    case LikelihoodKind::kHuber: {
      const auto width = static_cast<Real>(width_);
      return square < width * width ? square : 2 * width * std::sqrt(square) - width * width;
    }
    case LikelihoodKind::kAnisotropic: {
      const Real along = displacement.dot(noise_direction(vertex).template cast<Real>());
      return along * along + static_cast<Real>(across_) * (square - along * along);
    }
  }
  __builtin_unreachable();
}

template <typename Vector>
Vector LikelihoodTerm::alone_by_displacement(Index vertex, const Vector& displacement) const {
  using Real = typename Vector::Scalar;
  switch (kind_) {
    case LikelihoodKind::kQuadratic:
    case LikelihoodKind::kVolume:
      return 2 * displacement;
    case LikelihoodKind::kHuber: {
      const auto width = static_cast<Real>(width_);
      return 2 * std::min<Real>(1, width / std::max(displacement.norm(), width)) * displacement;
    }
    case LikelihoodKind::kAnisotropic: {
      const Vector direction = noise_direction(vertex).template cast<Real>();
      const Vector along = displacement.dot(direction) * direction;
      return 2 * (along + static_cast<Real>(across_) * (displacement - along));
    }
  }
  __builtin_unreachable();
}

template <typename Visit>
void LikelihoodTerm::visit_neighborhood(Index vertex, Visit visit) const {
  visit(vertex);
  for (const Index e : topology_.vertex_edges[vertex]) visit(other_end(topology_.edges[e], vertex));
}

template <typename Points>
auto LikelihoodTerm::flow(const Points& points, Index vertex) const {
  using Real = typename Points::Vector::Scalar;
  Flow<Real> flow;
  visit_neighborhood(vertex, [&](Index v) {
    const typename Points::Vector area = vertex_areas_[v].template cast<Real>();
    flow.volume += area.dot(points(v) - measured_[v].template cast<Real>());
    flow.area += area.norm();
  });
  return flow;
}

template <typename Points>
auto LikelihoodTerm::at_positions(const Points& points, Index vertex) const {
  using Real = typename Points::Vector::Scalar;
  const typename Points::Vector displacement = points(vertex) - measured_[vertex].template cast<Real>();
  Real energy = alone(vertex, displacement);
  if (kind_ == LikelihoodKind::kVolume) energy += static_cast<Real>(volume_weight_) * flow(points, vertex).square();
  return static_cast<Real>(weights_[vertex]) * energy;
}

template <typename Points>
auto LikelihoodTerm::by_position(const Points& points, Index vertex) const {
  using Vector = typename Points::Vector;
  using Real = typename Vector::Scalar;
  const Vector displacement = points(vertex) - measured_[vertex].template cast<Real>();
  Vector gradient = static_cast<Real>(weights_[vertex]) * alone_by_displacement(vertex, displacement);
  if (kind_ != LikelihoodKind::kVolume) return gradient;
  Real slope = 0;
  visit_neighborhood(vertex, [&](Index v) {
    const auto here = flow(points, v);
    if (here.area > 0) slope += static_cast<Real>(weights_[v]) * 2 * here.volume / (here.area * here.area);
  });
  gradient += static_cast<Real>(volume_weight_) * slope * vertex_areas_[vertex].template cast<Real>();
  return gradient;
}

}  // namespace crease
