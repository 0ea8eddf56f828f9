#pragma once

#include <array>
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

  /// ‖n_f − Σ w_k n_k‖² with the field's normals.
  double square(const Field& field, Index face) const;

  /// Π(1 − ε) over the face's edges, without the edge `except`.
  static double gate(const Field& field, Index face, Index except = kNone);

  /// Σ U(f) after these faces have got new normals, minus the sum now.
  using Moved = std::vector<std::pair<Index, UnitNormal>>;
  double change(const Field& field, const Moved& moved) const;

 private:
  template <typename NormalOf>
  double square(const Field& field, Index face, NormalOf normal_of) const;

  std::vector<std::array<float, 3>> weights_;  ///< per face; all 0 where there is no term
};

}  // namespace crease
