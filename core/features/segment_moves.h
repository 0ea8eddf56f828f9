#pragma once

#include <vector>

#include "core/features/segmentation.h"

namespace crease {

// The steps of segment_faces. `segments` are numbered from 0. Numbers without faces are allowed.

/// Floods a watershed of the distance from ridges [Mangan & Whitaker 1999], counted in rings of vertices up to
/// `gap_rings`. No basin crosses a ridge; the two sides of a ridge meet only in its gaps. Narrow parts of a segment
/// fall apart, and merging joins them again.
std::vector<Index> seed_segments(const SegmentField& field);

/// Single faces, but for those that are `gap_rings` from any ridge: no border pays among them, so that their connected
/// parts are one segment each.
std::vector<Index> seed_faces(const SegmentField& field);

/// The whole border between two segments, a < b, and what it costs.
struct SegmentBorder {
  Index a, b;
  double cost;
};

/// Merges pairs of neighbours in rounds, and returns the borders that are left. A pair is merged if their border costs
/// both of them more than any other border does. The result is close to that of merge_segments, in a fraction of the
/// time. Sizes do not count: they would make the segments left between pairs merge across ridges. Stops when few such
/// pairs are left.
std::vector<SegmentBorder> coarsen_segments(const SegmentField& field, std::vector<Index>& segments);

/// Coarsens, then merges pairs of neighbours as long as that lowers the energy, the pair with the most expensive border
/// first: greedy additive edge contraction [Keuper et al. 2015]. Sizes decide whether a pair is merged, but not the
/// order.
void merge_segments(const SegmentField& field, std::vector<Index>& segments);

/// Expands every segment locally once, in order.
void expand_segments(const SegmentField& field, std::vector<Index>& segments);

/// Gives each connected part of a segment its own number, in the order of their first faces. Returns their count.
Index split_segments(const SegmentField& field, std::vector<Index>& segments);

/// Calls `visit(edge, neighbour)` for every interior edge of the face.
template <typename Visit>
void for_each_neighbour(const SegmentField& field, Index face, Visit visit) {
  const std::array<Index, 3>&edges = field.topology().face_edges[face], &others = field.neighbors(face);
  for (std::size_t k = 0; k < edges.size(); ++k) {
    if (others[k] != kNone) visit(edges[k], others[k]);
  }
}

}  // namespace crease
