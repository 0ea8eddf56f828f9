#include "core/geometry/vertex_fans.h"

#include <algorithm>

namespace crease {

void VertexFans::collect(Index vertex) {
  corners_.clear();
  for (const Index face : topology_.vertex_faces[vertex]) {
    place_[face] = corners_.size();
    corners_.push_back(corner_at(face, vertex));
  }
  used_.assign(corners_.size(), 0);
}

Corner VertexFans::corner_at(Index face, Index vertex) const {
  const Triangle& corners = faces_[face];
  const auto k = static_cast<std::size_t>(std::ranges::find(corners, vertex) - corners.begin());
  Corner corner{face, corners[(k + 1) % 3], corners[(k + 2) % 3], kNone, kNone, kNone};
  corner.edge_b = edge_between(face, vertex, corner.b);
  corner.rim = edge_between(face, corner.b, corner.c);
  corner.edge_c = edge_between(face, corner.c, vertex);
  return corner;
}

Index VertexFans::edge_between(Index face, Index a, Index b) const {
  for (const Index edge : topology_.face_edges[face]) {
    if (edge != kNone && topology_.edges[edge] == Edge{std::min(a, b), std::max(a, b)}) return edge;
  }
  return kNone;
}

std::span<const Corner> VertexFans::fan_from(std::size_t first) {
  fan_.clear();
  for (std::size_t i = first;;) {
    used_[i] = 1;
    fan_.push_back(corners_[i]);
    const Index next = topology_.face_across(corners_[i].face, corners_[i].edge_c);
    if (next == kNone || used_[place_[next]] != 0) return fan_;
    i = place_[next];
  }
}

}  // namespace crease
