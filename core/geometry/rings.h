#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/surface.h"

namespace crease {

/// What the vertex process needs to see round each vertex (§3.2, Fig. 1), laid out in the order of the visits.
///
/// The faces at a vertex form fans, and a fan is cut into blocks of up to six faces. Lanes 1 to 6 of a block hold the
/// block's faces in the order of turning; lane k also holds the ring's point between the faces of lanes k − 1 and k.
/// Lane 0 repeats the face before, lane 7 has a point only, so that a block needs nothing of its neighbours and a visit
/// is straight code without a branch. Unused lanes repeat what is there, with edges that weigh nothing.
struct Rings {
  static constexpr std::size_t kLanes = 8;
  static constexpr std::size_t kFaces = kLanes - 2;

  struct Block {
    std::array<Index, kLanes> points{};
    std::array<Index, kLanes> faces{};        ///< between this point and the next
    std::array<Index, kLanes> outer_faces{};  ///< beyond the rim edge, facing the vertex
    std::array<Index, kLanes> rim_edges{};    ///< `no_edge` where the prior has no term
    std::array<Index, kLanes>
        spoke_edges{};     ///< between the faces of the lane before and of this one; `no_edge` likewise
    Index face_count = 0;  ///< lanes 1 to face_count are the block's own
  };

  /// Round each of `sites`, which are vertices.
  Rings(const Surface& surface, std::span<const Index> sites);

  std::span<const Block> operator[](std::size_t slot) const {
    return {blocks.data() + starts[slot], blocks.data() + starts[slot + 1]};
  }

  std::vector<Block> blocks;
  std::vector<std::size_t> starts;  ///< per site
  std::size_t longest = 0;          ///< blocks of a vertex
  Index no_edge = 0;                ///< one past the last edge
};

}  // namespace crease
