#pragma once

#include <span>
#include <vector>

#include "core/base/thread_team.h"
#include "core/mesh/mesh.h"

namespace crease {

/// Edges with at least this ridge label are drawn and counted as ridges.
inline constexpr double kRidgeThreshold = 0.5;
inline bool is_ridge(double label) { return label >= kRidgeThreshold; }

/// An undirected edge, v0 < v1.
struct Edge {
  Index v0 = kNone;
  Index v1 = kNone;
  bool operator==(const Edge&) const = default;
};

inline Index other_end(const Edge& edge, Index vertex) { return edge.v0 == vertex ? edge.v1 : edge.v0; }

/// The one of the two faces of an edge that is not `face`.
inline Index other_face(const std::array<Index, 2>& edge_faces, Index face) {
  return edge_faces[0] == face ? edge_faces[1] : edge_faces[0];
}

/// Rows of indices of different lengths in one flat array.
struct IndexRows {
  std::vector<Index> starts{0};  ///< number of rows + 1
  std::vector<Index> items;

  std::span<const Index> operator[](std::size_t row) const {
    return {items.data() + starts[row], items.data() + starts[row + 1]};
  }
  std::size_t size() const { return starts.size() - 1; }
};

/// The adjacency of vertices, edges and faces. Edges are in the order in which the faces first use them.
///
/// An edge with one face is a boundary edge, an edge with two faces is interior, and an edge with more is non-manifold.
/// Only interior edges have a smoothness term and a ridge label.
///
/// The upload may wind the faces of a component inconsistently. `flipped` marks the faces that must be reversed for a
/// consistent orientation, in which the larger part of a component keeps its winding. All normals and signed angles use
/// this orientation. Where none exists, as on a Möbius strip, some edges are `twisted` and count as boundary edges.
struct Topology {
  std::vector<Edge> edges;
  std::vector<std::array<Index, 2>> edge_faces;  ///< the first two faces; kNone if there are fewer
  std::vector<std::uint32_t> edge_face_count;    ///< including faces after the first two
  std::vector<std::uint8_t> edge_twisted;
  std::vector<std::array<Index, 3>> face_edges;  ///< from corner k to k + 1; kNone if these are the same vertex
  std::vector<std::uint8_t> flipped;             ///< per face
  IndexRows vertex_faces;
  IndexRows vertex_edges;

  bool is_interior(std::size_t edge) const { return edge_face_count[edge] == 2 && edge_twisted[edge] == 0; }

  /// The face across `edge` from `face`; kNone if the edge is kNone or not interior.
  Index face_across(Index face, Index edge) const {
    return edge != kNone && is_interior(edge) ? other_face(edge_faces[edge], face) : kNone;
  }
};

/// Builds the adjacency of `mesh` in O(n log n). Indices must be in range.
Topology build_topology(const Mesh& mesh);

/// Fills in which faces and edges of `topology` each vertex of `mesh` has.
void list_by_vertex(const Mesh& mesh, Topology& topology, ThreadTeam& team = calling_thread());

/// Connected components, where faces with a common vertex are connected, in the order of their first vertices.
struct Components {
  std::vector<Index> of_vertex;  ///< kNone for isolated vertices
  std::size_t count = 0;
};
Components find_components(const Mesh& mesh);

/// The mean length of all edges, which is the unit ℓ of every length parameter. Zero if there are no edges.
double mean_edge_length(const std::vector<Vec3>& positions, const std::vector<Edge>& edges);

/// The triangle in the consistent orientation.
Triangle oriented(const Mesh& mesh, const Topology& topology, std::size_t face);

/// The unit normals of all faces in the consistent orientation; zero for faces without area.
std::vector<Vec3> face_normals(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& positions,
                               ThreadTeam& team = calling_thread());

/// The dihedral angles of all edges, radians in [−π, π]: 0 flat, + convex, − concave; 0 for edges that are not
/// interior.
std::vector<double> signed_dihedral_angles(const Mesh& mesh, const Topology& topology,
                                           const std::vector<Vec3>& positions, ThreadTeam& team = calling_thread());

}  // namespace crease
