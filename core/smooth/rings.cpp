#include "core/smooth/rings.h"

#include <algorithm>
#include <array>

namespace crease {
namespace {

/// A face as seen from one of its corners: in the order of turning, edge to b, edge between b and c, edge to c.
struct Corner {
  Index face = kNone, b = kNone, c = kNone;
  Index edge_b = kNone, rim = kNone, edge_c = kNone;
};

/// Builds the lanes of one vertex after another; scratch is kept between them.
class RingBuilder {
 public:
  RingBuilder(const Field& field, Index no_edge)
      : field_(field), topology_(field.topology), no_edge_(no_edge), place_(field.faces.size(), 0) {}

  void append(Index vertex, std::vector<Rings::Lane>& lanes) {
    const auto ring = topology_.vertex_faces[vertex];
    corners_.clear();
    for (const Index face : ring) {
      place_[face] = corners_.size();
      corners_.push_back(corner_at(face, vertex));
    }
    used_.assign(corners_.size(), 0);
    // Open fans first, each from its beginning; what is left is closed.
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (used_[i] == 0 && across(corners_[i], corners_[i].edge_b) == kNone) append_fan(i, lanes);
    }
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (used_[i] == 0) append_fan(i, lanes);
    }
  }

 private:
  Corner corner_at(Index face, Index vertex) const {
    const Triangle& corners = field_.faces[face];
    const auto k = static_cast<std::size_t>(std::ranges::find(corners, vertex) - corners.begin());
    Corner corner{face, corners[(k + 1) % 3], corners[(k + 2) % 3], kNone, kNone, kNone};
    corner.edge_b = edge_between(face, vertex, corner.b);
    corner.rim = edge_between(face, corner.b, corner.c);
    corner.edge_c = edge_between(face, corner.c, vertex);
    return corner;
  }

  Index edge_between(Index face, Index a, Index b) const {
    for (const Index edge : topology_.face_edges[face]) {
      if (edge != kNone && topology_.edges[edge] == Edge{std::min(a, b), std::max(a, b)}) return edge;
    }
    return kNone;
  }

  /// The face on the other side of an interior edge, kNone where there is none.
  Index across(const Corner& corner, Index edge) const {
    if (edge == kNone || !topology_.is_interior(edge)) return kNone;
    const auto [f0, f1] = topology_.edge_faces[edge];
    return f0 == corner.face ? f1 : f0;
  }

  Rings::Lane lane_of(const Corner& corner, Index spoke) const {
    const Index outer = across(corner, corner.rim);
    return {corner.b, corner.face, outer != kNone ? outer : corner.face, outer != kNone ? corner.rim : no_edge_, spoke};
  }

  void append_fan(std::size_t first, std::vector<Rings::Lane>& lanes) {
    const std::size_t copy_of_last = lanes.size();
    const bool closed = across(corners_[first], corners_[first].edge_b) != kNone;
    if (closed) lanes.emplace_back();
    Index spoke = closed ? corners_[first].edge_b : no_edge_;
    std::size_t i = first;
    for (;;) {
      used_[i] = 1;
      lanes.push_back(lane_of(corners_[i], spoke));
      spoke = corners_[i].edge_c;
      const Index next = across(corners_[i], spoke);
      if (next == kNone || used_[place_[next]] != 0) break;
      i = place_[next];
    }
    if (closed) {
      lanes[copy_of_last] = lane_of(corners_[i], no_edge_);
      lanes[copy_of_last].rim_edge = no_edge_;
    }
    lanes.push_back({corners_[i].c, kNone, corners_[i].face, no_edge_, no_edge_});
  }

  const Field& field_;
  const Topology& topology_;
  Index no_edge_;
  std::vector<std::size_t> place_;  ///< of a face among the corners at hand
  std::vector<Corner> corners_;
  std::vector<std::uint8_t> used_;
};

}  // namespace

Rings::Rings(const Field& field, const Schedule& schedule)
    : starts(1, 0), no_edge(static_cast<Index>(field.topology.edges.size())) {
  RingBuilder builder(field, no_edge);
  lanes.reserve(4 * field.faces.size() + schedule.sites.size());
  for (const Index vertex : schedule.sites) {
    builder.append(vertex, lanes);
    starts.push_back(lanes.size());
    longest = std::max(longest, starts.back() - starts[starts.size() - 2]);
  }
}

}  // namespace crease
