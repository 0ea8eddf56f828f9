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

/// Builds the blocks of one vertex after another; scratch is kept between them.
class RingBuilder {
 public:
  RingBuilder(const Field& field, Index no_edge)
      : field_(field), topology_(field.topology), no_edge_(no_edge), place_(field.faces.size(), 0) {}

  void append(Index vertex, std::vector<Rings::Block>& blocks) {
    const auto ring = topology_.vertex_faces[vertex];
    corners_.clear();
    for (const Index face : ring) {
      place_[face] = corners_.size();
      corners_.push_back(corner_at(face, vertex));
    }
    used_.assign(corners_.size(), 0);
    // Open fans first, each from its beginning; what is left is closed.
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (used_[i] == 0 && across(corners_[i], corners_[i].edge_b) == kNone) append_fan(i, blocks);
    }
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (used_[i] == 0) append_fan(i, blocks);
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

  void append_fan(std::size_t first, std::vector<Rings::Block>& blocks) {
    fan_.clear();
    for (std::size_t i = first;;) {
      used_[i] = 1;
      fan_.push_back(corners_[i]);
      const Index next = across(corners_[i], corners_[i].edge_c);
      if (next == kNone || used_[place_[next]] != 0) break;
      i = place_[next];
    }
    const bool closed = across(fan_[0], fan_[0].edge_b) != kNone;
    for (std::size_t begin = 0; begin < fan_.size(); begin += Rings::kFaces) {
      const Corner* const before = begin > 0 ? &fan_[begin - 1] : closed ? &fan_.back() : nullptr;
      blocks.push_back(block_of({&fan_[begin], std::min(Rings::kFaces, fan_.size() - begin)}, before));
    }
  }

  Rings::Block block_of(std::span<const Corner> corners, const Corner* before) const {
    Rings::Block block;
    block.face_count = static_cast<Index>(corners.size());
    block.rim_edges.fill(no_edge_);
    block.spoke_edges.fill(no_edge_);
    block.points.fill(corners.back().c);
    block.faces.fill(corners.back().face);
    block.outer_faces.fill(corners.back().face);
    block.points[0] = before != nullptr ? before->b : corners[0].b;
    if (before != nullptr) block.faces[0] = before->face;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const std::size_t lane = k + 1;
      block.points[lane] = corners[k].b;
      block.faces[lane] = corners[k].face;
      const Index outer = across(corners[k], corners[k].rim);
      if (outer != kNone) {
        block.outer_faces[lane] = outer;
        block.rim_edges[lane] = corners[k].rim;
      }
      if (lane > 1 || before != nullptr) block.spoke_edges[lane] = corners[k].edge_b;
    }
    return block;
  }

  const Field& field_;
  const Topology& topology_;
  Index no_edge_;
  std::vector<std::size_t> place_;  ///< of a face among the corners at hand
  std::vector<Corner> corners_, fan_;
  std::vector<std::uint8_t> used_;
};

}  // namespace

Rings::Rings(const Field& field, const Schedule& schedule)
    : starts(1, 0), no_edge(static_cast<Index>(field.topology.edges.size())) {
  RingBuilder builder(field, no_edge);
  blocks.reserve(schedule.sites.size() * 3 / 2);
  for (const Index vertex : schedule.sites) {
    builder.append(vertex, blocks);
    starts.push_back(blocks.size());
    longest = std::max(longest, starts.back() - starts[starts.size() - 2]);
  }
}

}  // namespace crease
