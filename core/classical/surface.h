#pragma once

#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// What the classical methods move: a mesh in units of its mean edge length and relative to its first vertex that has a
/// face, with faces wound as the topology turns them.
struct Surface {
  /// Of a mesh with faces and with a finite mean edge length above 0.
  Surface(const Mesh& mesh, const Topology& mesh_topology);

  const Topology& topology;
  double unit = 1;  ///< mean edge length of the measured mesh
  Vec3 origin = Vec3::Zero();
  std::vector<Triangle> faces;
  std::vector<Vec3> measured;
  std::vector<Vec3> positions;
  std::vector<Index> movable;            ///< vertices that have edges, all of them interior
  std::vector<std::uint8_t> is_movable;  ///< per vertex

  /// Twice the area times the unit normal.
  Vec3 area_vector(std::size_t face) const;
  Vec3 centroid(std::size_t face) const;
  /// Unit normals of the present positions, zero for faces without area.
  void normals(std::vector<Vec3>& result) const;
  /// Positions in the units of the upload; vertices that did not move come back exactly.
  std::vector<Vec3> upload_positions(const Mesh& mesh) const;

  /// Calls `visit` for the faces that share an interior edge with `face`.
  template <typename Visit>
  void visit_face_neighbors(Index face, Visit visit) const {
    for (const Index edge : topology.face_edges[face]) {
      if (edge == kNone || !topology.is_interior(edge)) continue;
      const auto [f0, f1] = topology.edge_faces[edge];
      visit(f0 == face ? f1 : f0);
    }
  }

  /// Calls `visit` for the vertices one edge away.
  template <typename Visit>
  void visit_vertex_neighbors(Index vertex, Visit visit) const {
    for (const Index e : topology.vertex_edges[vertex]) visit(other_end(topology.edges[e], vertex));
  }
};

/// Unit vector along `vector`; zero where it is too short to have a direction.
Vec3 direction(const Vec3& vector);

}  // namespace crease
