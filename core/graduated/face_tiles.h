#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/lanes.h"
#include "core/mesh/topology.h"

namespace crease {

/// Faces in tiles of so few that what an evaluation notes down for them stays in the nearest cache. Around the faces of
/// a tile lies its rim: faces of other tiles next to them, whose normals they are compared with. Numbers within a tile
/// have sixteen bits. It pays where faces in a row, and vertices, are next to each other.
struct FaceTiles {
  static constexpr std::size_t kFaces = 512, kBlocks = kFaces / kLaneCount;

  using Place = std::uint16_t;
  /// Of eight faces: zeros where there are fewer.
  using Places = std::array<Place, kLaneCount>;

  struct Tile {
    std::size_t first_vertex = 0, vertices = 0;  ///< in `vertex`
    std::size_t first_sum = 0, sums = 0;         ///< one for each of its first vertices, those of its own faces
    std::size_t first_block = 0, blocks = 0;     ///< in `corners`: its own, then those of the rim
  };

  /// `corners` and `neighbors` as FlatMesh has them.
  FaceTiles(std::size_t vertex_count, std::size_t face_count, const std::array<std::vector<std::int32_t>, 3>& corners,
            const std::array<std::vector<std::int32_t>, 3>& neighbors);
  FaceTiles() = default;

  std::size_t blocks_of(std::size_t tile) const { return std::min(kBlocks, neighbors.size() - tile * kBlocks); }

  std::vector<Tile> tiles;
  std::vector<Index> vertex;                   ///< of the mesh, per vertex of a tile
  std::vector<std::array<Places, 3>> corners;  ///< in the tile's vertices
  std::vector<std::array<Places, 3>>
      neighbors;          ///< in its faces; tiles have their own blocks only, one after the other
  IndexRows vertex_sums;  ///< per vertex of the mesh: those of tiles
  std::size_t most_vertices = 0, most_blocks = 0;  ///< of a tile
};

}  // namespace crease
