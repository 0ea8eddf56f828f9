#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "core/energy/term.h"
#include "core/energy/vertex_move.h"

namespace crease {

/// Σ_v ‖a − 2v + b‖² over the vertices v with exactly two ridge edges, which lead to a and b: "the ridge edge itself is
/// smooth" (§3.3). labels_changed() chooses these vertices.
class RidgeLineTerm {
 public:
  static constexpr std::string_view kName = "ridge_line";
  static constexpr int kField = 8;
  static double weight(const MrfOptions& options) { return options.ridge_line_weight; }
  static Neighborhood neighborhood(const MrfOptions&) { return Neighborhood::kWide; }
  explicit RidgeLineTerm(const TermSetup& setup);

  double energy(const Field& field, ThreadTeam& team) const;
  void labels_changed(const Field& field, ThreadTeam& team);
  double change(const Field& field, const VertexMove& move) const;

  template <typename Points>
  auto at_positions(const Points& points, Index vertex) const {
    using Real = typename Points::Vector::Scalar;
    return has_term(vertex) ? second_difference(points, vertex).squaredNorm() : Real{0};
  }
  template <typename Points>
  auto by_position(const Points& points, Index vertex) const {
    using Vector = typename Points::Vector;
    using Real = typename Vector::Scalar;
    Vector gradient = Vector::Zero();
    visit_terms(vertex, [&](Index v, double times) {
      gradient += 2 * static_cast<Real>(times) * second_difference(points, v);
    });
    return gradient;
  }

 private:
  /// Calls `visit(v, times)` for each summand v that `vertex` is part of. A step of `vertex` changes a − 2v + b by
  /// `times` · step.
  template <typename Visit>
  void visit_terms(Index vertex, Visit visit) const {
    if (has_term(vertex)) visit(vertex, -2.0);
    for (const Index e : topology_.vertex_edges[vertex]) {
      const Index other = other_end(topology_.edges[e], vertex);
      if (has_term(other) && (neighbors_[other][0] == vertex || neighbors_[other][1] == vertex)) visit(other, 1.0);
    }
  }
  bool has_term(Index vertex) const { return neighbors_[vertex][0] != kNone; }
  template <typename Points>
  typename Points::Vector second_difference(const Points& points, Index vertex) const {
    const auto [a, b] = neighbors_[vertex];
    return points(a) - 2 * points(vertex) + points(b);
  }

  const Topology& topology_;
  std::vector<std::array<Index, 2>> neighbors_;  ///< per vertex, a and b; kNone if it has no summand
};

}  // namespace crease
