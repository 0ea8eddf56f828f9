#pragma once

#include <vector>

#include "core/mesh/face_vectors.h"
#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// The working frame of every method: a mesh in units of its mean edge length ℓ and relative to its first vertex that
/// has a face, with faces wound as the topology turns them.
struct Surface {
  /// Of a mesh with faces and with a finite mean edge length above 0. The topology must outlive the surface.
  Surface(const Mesh& mesh, const Topology& mesh_topology);

  const Topology& topology;
  double unit = 1;  ///< ℓ in the units of the upload
  Vec3 origin = Vec3::Zero();
  std::vector<Triangle> faces;
  std::vector<Vec3> measured;   ///< v⁰
  std::vector<Vec3> positions;  ///< v

  Vec3 area_vector(std::size_t face) const { return crease::area_vector(positions, faces[face]); }
  Vec3 centroid(std::size_t face) const { return crease::centroid(positions, faces[face]); }
  /// Unit normals of the present positions, zero for faces without area.
  void normals_of_faces(std::vector<Vec3>& result) const;
  /// Positions in the units of the upload; vertices that did not move come back exactly.
  std::vector<Vec3> upload_positions(const Mesh& mesh) const;

  /// Calls `visit(face across)` for the faces that share an interior edge with `face`.
  template <typename Visit>
  void visit_face_neighbors(Index face, Visit visit) const {
    for (const Index edge : topology.face_edges[face]) {
      if (const Index other = topology.face_across(face, edge); other != kNone) visit(other);
    }
  }

  /// Calls `visit` for the vertices one edge away.
  template <typename Visit>
  void visit_vertex_neighbors(Index vertex, Visit visit) const {
    for (const Index e : topology.vertex_edges[vertex]) visit(other_end(topology.edges[e], vertex));
  }
};

/// Per vertex whether it has edges and all of them are interior: 1, or 0 at boundaries and non-manifold edges.
std::vector<std::uint8_t> inner_vertices(const Topology& topology);

/// Whether a mesh has a finite mean edge length above 0, and so a working frame.
bool has_extent(const Mesh& mesh, const Topology& topology);

}  // namespace crease
