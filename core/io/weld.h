#pragma once

#include <vector>

#include "core/mesh/mesh.h"

namespace crease {

/// Finds vertices by their exact position; 0 and −0 are the same. Positions must be finite.
class PositionIndex {
 public:
  /// Returns the vertex of `positions` exactly at `position`, and appends it if there is none. All of `positions` must
  /// have been added by this function.
  Index find_or_append(std::vector<Vec3>& positions, const Vec3& position);

 private:
  void grow(const std::vector<Vec3>& positions);

  std::vector<Index> slots_;
};

/// Merges vertices at exactly the same position. The first of them keeps its place in the order and its weight.
/// `weights` has one per vertex, or is empty. Returns the number of vertices that were removed.
std::size_t weld_by_position(Mesh& mesh, std::vector<double>& weights);

}  // namespace crease
