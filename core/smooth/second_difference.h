#pragma once

#include <array>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

struct Field;

/// (x, y, z, 0): single precision suffices for a unit vector, and four of them are one aligned load.
using UnitNormal = Eigen::Vector4f;

/// The piecewise-quadratic prior (§5): on a quadratic surface normals change linearly, so that a face's normal is what
/// its three neighbours' normals interpolate at its centroid. U(f) = Π(1 − ε) ‖n_f − Σ w_k n_k‖² over the face's three
/// edges, with w_k the barycentric coordinates of its centroid among theirs; no term where an edge is not interior.
class SecondDifference {
 public:
  SecondDifference(const std::vector<Vec3>& positions, const std::vector<Triangle>& faces, const Topology& topology);

  /// n_f − Σ w_k n_k with normals `normal_of(face)`; zero where there is no term.
  template <typename NormalOf>
  auto of(const Field& field, Index face, NormalOf normal_of) const {
    using Normal = std::decay_t<decltype(normal_of(face))>;
    using Number = typename Normal::Scalar;
    Normal difference = has_term(face) ? normal_of(face) : Normal::Zero().eval();
    if (!has_term(face)) return difference;
    for (std::size_t k = 0; k < 3; ++k) {
      difference -= static_cast<Number>(weights_[face][k]) * normal_of(neighbor(field, face, k));
    }
    return difference;
  }
  /// ‖·‖² of it with the field's normals.
  double square(const Field& field, Index face) const;
  /// w of the neighbour across `edge`.
  double weight(const Field& field, Index face, Index edge) const;

  /// Π(1 − ε) over the face's edges, without the edge `except`.
  static double gate(const Field& field, Index face, Index except = kNone);

  /// Σ U(f) after these faces have got new normals, minus the sum now.
  using Moved = std::vector<std::pair<Index, UnitNormal>>;
  double change(const Field& field, const Moved& moved) const;

 private:
  bool has_term(Index face) const { return weights_[face][0] > 0; }
  static Index neighbor(const Field& field, Index face, std::size_t k);

  std::vector<std::array<float, 3>> weights_;  ///< per face; all 0 where there is no term
};

}  // namespace crease
