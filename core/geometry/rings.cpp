#include "core/geometry/rings.h"

#include <algorithm>

#include "core/geometry/vertex_fans.h"

namespace crease {
namespace {

/// Builds the blocks of one vertex after another.
class RingBuilder {
 public:
  RingBuilder(const Surface& surface, Index no_edge) : topology_(surface.topology), fans_(surface), no_edge_(no_edge) {}

  void append(Index vertex, std::vector<Rings::Block>& blocks) {
    fans_.visit(vertex, [&](std::span<const Corner> fan, bool closed) {
      for (std::size_t begin = 0; begin < fan.size(); begin += Rings::kFaces) {
        const Corner* const before = begin > 0 ? &fan[begin - 1] : closed ? &fan.back() : nullptr;
        blocks.push_back(block_of(fan.subspan(begin, std::min(Rings::kFaces, fan.size() - begin)), before));
      }
    });
  }

 private:
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
      const Index outer = topology_.face_across(corners[k].face, corners[k].rim);
      if (outer != kNone) {
        block.outer_faces[lane] = outer;
        block.rim_edges[lane] = corners[k].rim;
      }
      if (lane > 1 || before != nullptr) block.spoke_edges[lane] = corners[k].edge_b;
    }
    return block;
  }

  const Topology& topology_;
  VertexFans fans_;
  Index no_edge_;
};

}  // namespace

Rings::Rings(const Surface& surface, std::span<const Index> sites)
    : starts(1, 0), no_edge(static_cast<Index>(surface.topology.edges.size())) {
  RingBuilder builder(surface, no_edge);
  blocks.reserve(sites.size() * 3 / 2);
  for (const Index vertex : sites) {
    builder.append(vertex, blocks);
    starts.push_back(blocks.size());
    longest = std::max(longest, starts.back() - starts[starts.size() - 2]);
  }
}

}  // namespace crease
