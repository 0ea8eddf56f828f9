#pragma once

#include <vector>

#include "core/base/thread_team.h"
#include "core/mesh/face_vectors.h"
#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// The working frame of every method. Lengths are in units of the mean edge length ℓ, the origin is the first vertex
/// that has a face, and the faces are oriented consistently.
struct Surface {
  /// The mesh must have faces and a finite mean edge length above 0. The topology must outlive the surface.
  Surface(const Mesh& mesh, const Topology& mesh_topology, ThreadTeam& team = calling_thread());

  const Topology& topology;
  double unit = 1;  ///< ℓ in the units of the upload
  Vec3 origin = Vec3::Zero();
  std::vector<Triangle> faces;
  std::vector<Vec3> measured;   ///< v⁰
  std::vector<Vec3> positions;  ///< v

  Vec3 area_vector(std::size_t face) const { return crease::area_vector(positions, faces[face]); }
  Vec3 centroid(std::size_t face) const { return crease::centroid(positions, faces[face]); }
  /// Computes the unit normal of each face at the present positions; zero for faces without area.
  void normals_of_faces(std::vector<Vec3>& result) const;
  /// The positions in the units of the upload, which is `mesh`. Vertices that did not move are exactly those of `mesh`.
  std::vector<Vec3> upload_positions(const Mesh& mesh) const;

  /// Calls `visit(f)` for each face f that shares an interior edge with `face`.
  template <typename Visit>
  void visit_face_neighbors(Index face, Visit visit) const {
    for (const Index edge : topology.face_edges[face]) {
      if (const Index other = topology.face_across(face, edge); other != kNone) visit(other);
    }
  }

  /// Calls `visit(v)` for each vertex v that shares an edge with `vertex`.
  template <typename Visit>
  void visit_vertex_neighbors(Index vertex, Visit visit) const {
    for (const Index e : topology.vertex_edges[vertex]) visit(other_end(topology.edges[e], vertex));
  }
};

/// Per vertex, 1 if it has edges and all of them are interior, otherwise 0.
std::vector<std::uint8_t> inner_vertices(const Topology& topology);

/// Whether the mean edge length is finite and above 0, as a Surface requires.
bool has_extent(const Mesh& mesh, const Topology& topology);

}  // namespace crease
