#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/surface.h"

namespace crease {

/// A face as seen from one of its corners. In the orientation of the face: the edge to b, the rim edge from b to c, the
/// edge to c.
struct Corner {
  Index face = kNone, b = kNone, c = kNone;
  Index edge_b = kNone, rim = kNone, edge_c = kNone;
};

/// Visits the faces around a vertex in cyclic order, in fans that end at edges that are not interior. One object serves
/// many vertices, so that its memory is reused.
class VertexFans {
 public:
  explicit VertexFans(const Surface& surface)
      : faces_(surface.faces), topology_(surface.topology), place_(surface.faces.size(), 0) {}

  /// Calls `visit(fan, closed)` for each fan of `vertex`. In a closed fan, the first face follows the last.
  template <typename Visit>
  void visit(Index vertex, Visit visit) {
    collect(vertex);
    // Open fans first, each from its start. The remaining fans are closed.
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (used_[i] == 0 && topology_.face_across(corners_[i].face, corners_[i].edge_b) == kNone)
        visit(fan_from(i), false);
    }
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (used_[i] == 0) visit(fan_from(i), true);
    }
  }

 private:
  void collect(Index vertex);
  Corner corner_at(Index face, Index vertex) const;
  Index edge_between(Index face, Index a, Index b) const;
  std::span<const Corner> fan_from(std::size_t first);

  const std::vector<Triangle>& faces_;
  const Topology& topology_;
  std::vector<std::size_t> place_;  ///< per face, its index in corners_
  std::vector<Corner> corners_, fan_;
  std::vector<std::uint8_t> used_;
};

}  // namespace crease
