#include "core/mesh/openmesh.h"

#include <fmt/format.h>

#include "core/error.h"

namespace crease {
namespace {

[[noreturn]] void refuse(std::size_t face, std::string_view why) {
  throw Error(code::kMeshUnsupported, fmt::format("a half-edge mesh cannot hold face {}: {}", face, why),
              fmt::format("face {}", face));
}

/// OpenMesh would report these to its error log and leave the mesh half changed; so they are asked about first.
void require_addable(const HalfEdgeMesh& half_edges, const std::array<HalfEdgeMesh::VertexHandle, 3>& corners,
                     std::size_t face) {
  const auto& [a, b, c] = corners;
  if (a == b || b == c || c == a) refuse(face, "it has a vertex twice");
  for (std::size_t k = 0; k < 3; ++k) {
    if (!half_edges.is_boundary(corners[k])) {
      refuse(face, fmt::format("vertex {} is already surrounded by faces", corners[k].idx()));
    }
    const auto edge = half_edges.find_halfedge(corners[k], corners[(k + 1) % 3]);
    if (edge.is_valid() && !half_edges.is_boundary(edge)) {
      refuse(face, fmt::format("an earlier face runs from vertex {} to vertex {}, too", corners[k].idx(),
                               corners[(k + 1) % 3].idx()));
    }
  }
}

}  // namespace

Mesh from_openmesh(const HalfEdgeMesh& half_edges) {
  Mesh mesh;
  mesh.positions.reserve(half_edges.n_vertices());
  mesh.triangles.reserve(half_edges.n_faces());
  for (const auto vertex : half_edges.all_vertices()) {
    const auto& point = half_edges.point(vertex);
    mesh.positions.emplace_back(point[0], point[1], point[2]);
  }
  for (const auto face : half_edges.all_faces()) {
    // add_face starts a face at the half-edge that ends in its first corner.
    OpenMesh::HalfedgeHandle half_edge = half_edges.halfedge_handle(face);
    Triangle triangle{};
    for (Index& corner : triangle) {
      corner = static_cast<Index>(half_edges.to_vertex_handle(half_edge).idx());
      half_edge = half_edges.next_halfedge_handle(half_edge);
    }
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

HalfEdgeMesh to_openmesh(const Mesh& mesh) {
  HalfEdgeMesh half_edges;
  half_edges.reserve(mesh.positions.size(), mesh.positions.size() + mesh.triangles.size(), mesh.triangles.size());
  for (const Vec3& p : mesh.positions) half_edges.add_vertex({p.x(), p.y(), p.z()});
  for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
    std::array<HalfEdgeMesh::VertexHandle, 3> corners;
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] = HalfEdgeMesh::VertexHandle(static_cast<int>(mesh.triangles[face][k]));
    require_addable(half_edges, corners, face);
    if (!half_edges.add_face(corners[0], corners[1], corners[2]).is_valid()) {
      refuse(face, "its neighbourhood at a vertex cannot be linked into one fan");
    }
  }
  return half_edges;
}

}  // namespace crease
