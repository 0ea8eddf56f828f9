#pragma once

#include <vector>

#include "core/features/segmentation.h"

namespace crease {

/// The steps of segment_faces. `segments` are numbered from 0; numbers that no face has any more are allowed.

/// Watershed of the distance from ridges [Mangan & Whitaker 1999], counted in rings of vertices up to `gap_rings`: the
/// two sides of a ridge meet only in its gaps, and narrow places come apart, which merging mends. Never crosses a
/// ridge.
std::vector<Index> seed_segments(const SegmentField& field);

/// Merges, all at once and round by round, the pairs of neighbours whose border costs both more than any other border
/// of theirs: nearly what merge_segments does, at a fraction of its time. Heeds no sizes, by which what is left over
/// between pairs would be merged across ridges. Ends where few such pairs are left.
void coarsen_segments(const SegmentField& field, std::vector<Index>& segments);

/// Coarsens, then merges pair after pair of neighbours that lowers the energy, the one with the dearest border first:
/// greedy additive edge contraction [Keuper et al. 2015]. Sizes have a say in whether, but not in which first.
void merge_segments(const SegmentField& field, std::vector<Index>& segments);

/// One local expansion of every segment, in order.
void expand_segments(const SegmentField& field, std::vector<Index>& segments);

/// Gives each connected part of a segment a number of its own, in the order of their first faces; returns their count.
Index split_segments(const Topology& topology, std::vector<Index>& segments);

/// The face on the other side of an interior edge.
inline Index opposite_face(const Topology& topology, Index edge, Index face) {
  const auto [f0, f1] = topology.edge_faces[edge];
  return f0 == face ? f1 : f0;
}

/// Calls `visit(edge, neighbour)` for every interior edge of the face.
template <typename Visit>
void for_each_neighbour(const Topology& topology, Index face, Visit visit) {
  for (const Index edge : topology.face_edges[face]) {
    if (edge != kNone && topology.is_interior(edge)) visit(edge, opposite_face(topology, edge, face));
  }
}

}  // namespace crease
