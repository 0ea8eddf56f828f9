#pragma once

#include <array>
#include <vector>

#include "core/smooth/field.h"

namespace crease {

/// "The ridge edge itself is smooth" (§3.3): ‖a − 2v + b‖² at every vertex v that has exactly two labelled edges
/// (ε ≥ 0.5), to a and to b. Which vertices these are is taken from the labels once, when the vertex process begins to
/// move them.
class RidgeStraightness {
 public:
  RidgeStraightness(const Field& field, ThreadTeam& team);

  /// The term at a vertex, 0 where it has none.
  double energy(const Field& field, Index vertex) const;
  /// The sum of all terms after `vertex` has moved to `to`, minus the sum now.
  double change(const Field& field, Index vertex, const Vec3& to) const;

  /// The derivative of the sum by the position of `vertex`.
  Vec3 gradient(const Field& field, Index vertex) const;

 private:
  /// Calls `visit(v, times)` for the terms at v that change when `vertex` moves by `step`: by `times · step` inside
  /// ‖·‖.
  template <typename Visit>
  void visit_terms(const Field& field, Index vertex, Visit visit) const;
  bool has_term(Index vertex) const { return neighbors_[vertex][0] != kNone; }
  Vec3 second_difference(const Field& field, Index vertex) const;

  std::vector<std::array<Index, 2>> neighbors_;  ///< a and b; kNone where there is no term
};

}  // namespace crease
