#include "core/classical/surface.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace crease {
namespace {

constexpr double kNoLength = 1e-12;

}  // namespace

Vec3 direction(const Vec3& vector) {
  const double length = vector.norm();
  return length > kNoLength ? Vec3(vector / length) : Vec3::Zero();
}

Surface::Surface(const Mesh& mesh, const Topology& mesh_topology) : topology(mesh_topology) {
  unit = mean_edge_length(mesh.positions, topology.edges);
  origin = mesh.positions[mesh.triangles.front()[0]];
  faces.resize(mesh.triangles.size());
  for (std::size_t f = 0; f < faces.size(); ++f) faces[f] = oriented(mesh, topology, f);
  measured.reserve(mesh.positions.size());
  for (const Vec3& position : mesh.positions) measured.push_back((position - origin) / unit);
  positions = measured;
  is_movable.assign(positions.size(), 0);
  for (Index v = 0; v < positions.size(); ++v) {
    const auto edges = topology.vertex_edges[v];
    if (edges.empty() || !std::ranges::all_of(edges, [&](Index e) { return topology.is_interior(e); })) continue;
    is_movable[v] = 1;
    movable.push_back(v);
  }
}

Vec3 Surface::area_vector(std::size_t face) const {
  const auto [a, b, c] = faces[face];
  return (positions[b] - positions[a]).cross(positions[c] - positions[a]);
}

Vec3 Surface::centroid(std::size_t face) const {
  const auto [a, b, c] = faces[face];
  return (positions[a] + positions[b] + positions[c]) / 3;
}

void Surface::normals(std::vector<Vec3>& result) const {
  result.resize(faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) result[f] = direction(area_vector(f));
}

std::vector<Vec3> Surface::upload_positions(const Mesh& mesh) const {
  std::vector<Vec3> result(mesh.positions);
  for (const Index v : movable) {
    const Vec3 moved = positions[v] * unit + origin;
    if (positions[v] != measured[v] && moved.allFinite()) result[v] = moved;
  }
  return result;
}

}  // namespace crease
