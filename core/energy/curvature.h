#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "core/energy/term.h"
#include "core/energy/vertex_move.h"

namespace crease {

/// The piecewise-quadratic prior (§5), Σ_f Π_k (1 − ε_k) ‖n_f − Σ_k w_k n_k‖² over the three edges and neighbours k of
/// each face f. On a quadratic surface, normals change linearly: the normal of a face is the interpolation of its
/// neighbours' normals. The weights w_k are the barycentric coordinates of the face's centroid in the triangle of its
/// neighbours' centroids. Only faces with three interior edges have a summand.
class CurvatureTerm {
 public:
  static constexpr std::string_view kName = "curvature";
  static constexpr int kField = 6;
  static double weight(const MrfOptions& options) { return options.curvature_weight; }
  static Neighborhood neighborhood(const MrfOptions&) { return Neighborhood::kWide; }
  explicit CurvatureTerm(const TermSetup& setup);

  double energy(const Field& field, ThreadTeam& team) const;
  void positions_changed(const Field& field, ThreadTeam& team);
  void labels_changed(const Field& field, ThreadTeam& team);
  double slope(const Field& field, Index edge) const;
  double change(const Field& field, const VertexMove& move) const;

  template <typename Normals>
  auto at_normals(const Normals& normals, Index face) const {
    using Real = typename Normals::Vector::Scalar;
    return static_cast<Real>(gates_[face]) * second_difference(normals, face).squaredNorm();
  }
  template <typename Normals>
  auto by_normal(const Normals& normals, Index face) const;

  /// n_f − Σ w_k n_k, with `normals(face)` for n; zero for faces without a summand.
  template <typename Normals>
  auto second_difference(const Normals& normals, Index face) const;

 private:
  bool has_term(Index face) const { return weights_[face][0] > 0; }
  Index neighbor(Index face, std::size_t k) const {
    const Index edge = topology_.face_edges[face][k];
    return other_face(topology_.edge_faces[edge], face);
  }
  /// Π(1 − ε) over the edges of the face other than `except`.
  double gate(const Field& field, Index face, Index except = kNone) const;

  const Topology& topology_;
  std::vector<std::array<float, 3>> weights_;  ///< per face; all 0 if it has no summand
  std::vector<double> squares_;                ///< per face, ‖second difference of the field's normals‖²
  std::vector<double> gates_;                  ///< per face, Π(1 − ε)
};

template <typename Normals>
auto CurvatureTerm::second_difference(const Normals& normals, Index face) const {
  using Normal = typename Normals::Vector;
  using Real = typename Normal::Scalar;
  if (!has_term(face)) return Normal(Normal::Zero());
  Normal difference = normals(face);
  for (std::size_t k = 0; k < 3; ++k) difference -= static_cast<Real>(weights_[face][k]) * normals(neighbor(face, k));
  return difference;
}

template <typename Normals>
auto CurvatureTerm::by_normal(const Normals& normals, Index face) const {
  using Normal = typename Normals::Vector;
  using Real = typename Normal::Scalar;
  Normal gradient = 2 * static_cast<Real>(gates_[face]) * second_difference(normals, face);
  for (const Index edge : topology_.face_edges[face]) {
    const Index other = topology_.face_across(face, edge);
    if (other == kNone || !has_term(other)) continue;
    const auto& edges = topology_.face_edges[other];
    const std::size_t k = edges[0] == edge ? 0 : edges[1] == edge ? 1 : 2;
    gradient -= 2 * static_cast<Real>(gates_[other]) * static_cast<Real>(weights_[other][k]) *
                second_difference(normals, other);
  }
  return gradient;
}

}  // namespace crease
