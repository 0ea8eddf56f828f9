#include "core/geometry/surface.h"

#include <algorithm>
#include <cmath>

namespace crease {
namespace {

std::vector<Triangle> oriented_faces(const Mesh& mesh, const Topology& topology, ThreadTeam& team) {
  std::vector<Triangle> faces(mesh.triangles.size());
  for_each(faces.size(), team, [&](std::size_t f) { faces[f] = oriented(mesh, topology, f); });
  return faces;
}

std::vector<Vec3> relative_positions(const std::vector<Vec3>& positions, const Vec3& origin, double unit,
                                     ThreadTeam& team) {
  std::vector<Vec3> result(positions.size());
  for_each(result.size(), team, [&](std::size_t v) { result[v] = (positions[v] - origin) / unit; });
  return result;
}

}  // namespace

Surface::Surface(const Mesh& mesh, const Topology& mesh_topology, ThreadTeam& team)
    : topology(mesh_topology),
      unit(mean_edge_length(mesh.positions, topology.edges)),
      origin(mesh.positions[mesh.triangles.front()[0]]),
      faces(oriented_faces(mesh, topology, team)),
      measured(relative_positions(mesh.positions, origin, unit, team)),
      positions(measured) {}

void Surface::normals_of_faces(std::vector<Vec3>& result) const {
  result.resize(faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) result[f] = direction(area_vector(f));
}

std::vector<Vec3> Surface::upload_positions(const Mesh& mesh) const {
  std::vector<Vec3> result(mesh.positions);
  for (std::size_t v = 0; v < result.size(); ++v) {
    if (positions[v] == measured[v]) continue;
    const Vec3 moved = positions[v] * unit + origin;
    if (moved.allFinite()) result[v] = moved;
  }
  return result;
}

std::vector<std::uint8_t> inner_vertices(const Topology& topology) {
  std::vector<std::uint8_t> inner(topology.vertex_edges.size(), 0);
  for (std::size_t v = 0; v < inner.size(); ++v) {
    const auto edges = topology.vertex_edges[v];
    inner[v] = !edges.empty() && std::ranges::all_of(edges, [&](Index e) { return topology.is_interior(e); }) ? 1 : 0;
  }
  return inner;
}

bool has_extent(const Mesh& mesh, const Topology& topology) {
  const double length = mean_edge_length(mesh.positions, topology.edges);
  return length > 0 && std::isfinite(length);
}

}  // namespace crease
