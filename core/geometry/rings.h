#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/surface.h"

namespace crease {

/// The neighbourhood of each vertex in the vertex process (§3.2, Fig. 1), stored in the order of the visits.
///
/// The faces at a vertex form fans. Each fan is cut into blocks of up to six consecutive faces, in lanes 1 to 6. Lane k
/// also has the point of the ring that the faces of lanes k − 1 and k share. Lane 0 repeats the face before the block,
/// and lane 7 has only a point. A block therefore needs no other block, and its code has no branches. Unused lanes
/// repeat other lanes, with `no_edge` as their edges.
struct Rings {
  static constexpr std::size_t kLanes = 8;
  static constexpr std::size_t kFaces = kLanes - 2;

  struct Block {
    std::array<Index, kLanes> points{};
    std::array<Index, kLanes> faces{};        ///< between this lane's point and the next
    std::array<Index, kLanes> outer_faces{};  ///< across the rim edge
    std::array<Index, kLanes> rim_edges{};    ///< opposite the vertex; `no_edge` if not interior
    std::array<Index, kLanes> spoke_edges{};  ///< between the faces of lane k − 1 and k; `no_edge` likewise
    Index face_count = 0;                     ///< the block's own faces are in lanes 1 to face_count
  };

  /// Builds the ring of each vertex in `sites`.
  Rings(const Surface& surface, std::span<const Index> sites);

  std::span<const Block> operator[](std::size_t slot) const {
    return {blocks.data() + starts[slot], blocks.data() + starts[slot + 1]};
  }

  std::vector<Block> blocks;
  std::vector<std::size_t> starts;  ///< per site, its first block; then the number of blocks
  std::size_t longest = 0;          ///< the largest number of blocks of a vertex
  Index no_edge = 0;                ///< one past the last edge
};

}  // namespace crease
