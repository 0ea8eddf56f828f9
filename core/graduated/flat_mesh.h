#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/thread_team.h"
#include "core/geometry/lanes.h"
#include "core/geometry/surface.h"
#include "core/graduated/face_tiles.h"

namespace crease {

/// Positions or vectors, three numbers for each vertex or face: all x first, then all y, then all z.
using FlatVectors = std::vector<float>;

/// Signed, because SIMD gathers take signed 32-bit indices.
using FlatIndex = std::int32_t;

/// A mesh as the descent reads it: flat arrays in single precision, in units of ℓ and around its centre, so that loops
/// over faces, edges and vertices run in SIMD lanes. Only interior edges are in it.
struct FlatMesh {
  /// `faces` are wound as the topology turns them, `positions` in units of ℓ. The topology need not outlive the object.
  FlatMesh(const Topology& topology, const std::vector<Triangle>& faces, const std::vector<Vec3>& positions,
           ThreadTeam& team = calling_thread());
  explicit FlatMesh(const Surface& surface, ThreadTeam& team = calling_thread())
      : FlatMesh(surface.topology, surface.faces, surface.measured, team) {}

  std::size_t vertex_count = 0, face_count = 0, edge_count = 0;

  /// Blocks of eight, the last one perhaps not full.
  std::size_t face_blocks() const { return (face_count + kLaneCount - 1) / kLaneCount; }

  std::array<std::vector<FlatIndex>, 3> corners;  ///< per face; wound as the topology turns it
  std::array<std::vector<FlatIndex>, 3>
      neighbors;                                ///< per face: across the edge from corner k to k + 1; itself where none
  std::array<std::vector<FlatIndex>, 3> sides;  ///< per face: that edge; edge_count where there is none
  std::array<std::vector<FlatIndex>, 2> edge_faces, edge_ends,
      edge_opposites;                 ///< opposite: the third corners of the faces
  std::vector<Index> topology_edges;  ///< per edge: its index in the topology

  FaceTiles tiles;
  IndexRows vertex_corners;             ///< per vertex: 3 · face + k
  IndexRows vertex_neighbors;           ///< per vertex: across interior edges
  IndexRows vertex_stencils;            ///< per vertex: the edges that it ends or lies opposite of
  std::vector<std::uint8_t> at_border;  ///< per vertex: 1 where one of its edges is not interior

  FlatVectors measured;

  /// The mean of `values` over each vertex and its neighbours, `rounds` times: about 6 · rounds vertices wide.
  void diffuse(std::vector<float>& values, int rounds) const;

 private:
  void put_edges(const Topology& topology, const std::vector<Triangle>& faces, ThreadTeam& team);
  void put_faces(const Topology& topology, const std::vector<Triangle>& faces, ThreadTeam& team);
  void list_by_vertex(ThreadTeam& team);
};

/// Unsigned dihedral angle of each edge of `mesh` in radians.
std::vector<float> dihedral_angles(const FlatMesh& mesh, std::span<const float> positions,
                                   ThreadTeam& team = calling_thread());

/// Vector number `i` of flat ones.
inline std::array<float, 3> vector_at(std::span<const float> flat, std::size_t i) {
  const std::size_t count = flat.size() / 3;
  return {flat[i], flat[count + i], flat[2 * count + i]};
}

inline void set_vector(FlatVectors& flat, std::size_t i, const std::array<float, 3>& vector) {
  const std::size_t count = flat.size() / 3;
  for (std::size_t axis = 0; axis < 3; ++axis) flat[axis * count + i] = vector[axis];
}

/// Sets vector number `i` of those in blocks of eight.
inline void set_vector(std::vector<LaneVectors>& blocks, std::size_t i, const std::array<float, 3>& vector) {
  LaneVectors& block = blocks[i / kLaneCount];
  block.x[i % kLaneCount] = vector[0];
  block.y[i % kLaneCount] = vector[1];
  block.z[i % kLaneCount] = vector[2];
}

/// Twice the area of a face along its normal.
inline std::array<float, 3> area_vector(const FlatMesh& mesh, std::span<const float> positions, std::size_t face) {
  const auto corner = [&](std::size_t k) {
    return vector_at(positions, static_cast<std::size_t>(mesh.corners[k][face]));
  };
  const auto a = corner(0), b = corner(1), c = corner(2);
  const float ux = b[0] - a[0], uy = b[1] - a[1], uz = b[2] - a[2];
  const float vx = c[0] - a[0], vy = c[1] - a[1], vz = c[2] - a[2];
  return {uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx};
}

/// The inner products of each vertex's vectors in `a` and `b`.
std::vector<float> products(std::span<const float> a, std::span<const float> b);

/// a − b, item by item.
FlatVectors difference(std::span<const float> a, std::span<const float> b);

}  // namespace crease
