#pragma once

#include <span>
#include <vector>

#include "core/mesh/mesh.h"

namespace crease {

/// Edges with a ridge label of at least this are drawn and counted as ridges.
inline constexpr double kRidgeThreshold = 0.5;
inline bool is_ridge(double label) { return label >= kRidgeThreshold; }

/// An undirected edge, v0 < v1.
struct Edge {
  Index v0 = kNone;
  Index v1 = kNone;
  bool operator==(const Edge&) const = default;
};

inline Index other_end(const Edge& edge, Index vertex) { return edge.v0 == vertex ? edge.v1 : edge.v0; }

/// Of the two faces at an edge the one that is not `face`.
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

/// Who touches whom in a mesh. Edges come in the order in which the faces first name them.
///
/// An edge with exactly two faces is interior; one face makes it a boundary, more make it non-manifold. Only interior
/// edges carry a smoothness term and a ridge label.
///
/// Faces of a component may be wound against each other in the upload. `flipped` marks those that have to be turned
/// so that neighbours agree (the larger part of a component keeps its winding); normals and signed angles below are of
/// the turned faces. Where no turning helps (a Möbius strip), the edge is `twisted` and is treated as a boundary.
struct Topology {
  std::vector<Edge> edges;
  std::vector<std::array<Index, 2>> edge_faces;  ///< the first two faces, kNone where there are fewer
  std::vector<std::uint32_t> edge_face_count;    ///< all faces
  std::vector<std::uint8_t> edge_twisted;
  std::vector<std::array<Index, 3>> face_edges;  ///< edge from corner k to k+1; kNone where the two corners coincide
  std::vector<std::uint8_t> flipped;             ///< per face
  IndexRows vertex_faces;
  IndexRows vertex_edges;

  bool is_interior(std::size_t edge) const { return edge_face_count[edge] == 2 && edge_twisted[edge] == 0; }

  /// The face across `edge` from `face`; kNone where the edge is kNone or not interior.
  Index face_across(Index face, Index edge) const {
    return edge != kNone && is_interior(edge) ? other_face(edge_faces[edge], face) : kNone;
  }
};

/// Builds the adjacency of `mesh` in O(n log n). Indices must be in range.
Topology build_topology(const Mesh& mesh);

/// Number of connected components of vertices that have faces (joined by shared vertices).
std::size_t count_components(const Mesh& mesh);

/// Mean length over all edges, the unit ℓ of every length parameter. Zero when there are no edges.
double mean_edge_length(const std::vector<Vec3>& positions, const std::vector<Edge>& edges);

/// The triangle as it is wound after `flipped`.
Triangle oriented(const Mesh& mesh, const Topology& topology, std::size_t face);

/// Unit normals of the turned faces, zero for faces without area.
std::vector<Vec3> face_normals(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& positions);

/// Dihedral angle of every edge in radians, in [−π, π]: 0 flat, + convex, − concave; 0 for edges that are not interior.
std::vector<double> signed_dihedral_angles(const Mesh& mesh, const Topology& topology,
                                           const std::vector<Vec3>& positions);

}  // namespace crease
