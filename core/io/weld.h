#pragma once

#include <vector>

#include "core/mesh/mesh.h"

namespace crease {

/// Finds vertices by exact position; 0 and −0 are the same. Positions must be finite.
class PositionIndex {
 public:
  /// The vertex of `positions` that lies exactly at `position`; appended when there is none yet. All vertices of
  /// `positions` must have come this way.
  Index find_or_append(std::vector<Vec3>& positions, const Vec3& position);

 private:
  void grow(const std::vector<Vec3>& positions);

  std::vector<Index> slots_;
};

/// Makes one vertex of all that lie exactly at the same position; the first of them keeps its place in the order and
/// its weight; `weights` are one per vertex, or none.
/// \return the number of vertices that were removed
std::size_t weld_by_position(Mesh& mesh, std::vector<double>& weights);

}  // namespace crease
