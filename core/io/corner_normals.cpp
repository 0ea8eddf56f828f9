#include "core/io/corner_normals.h"

#include "core/io/corner_fans.h"
#include "core/mesh/face_vectors.h"
#include "core/mesh/position_index.h"

namespace crease {
namespace {

/// The vector in unit length, or nothing if it has no direction.
std::optional<Vec3> unit_of(const Vec3& vector) {
  const Vec3 unit = vector.stableNormalized();
  if (!unit.allFinite() || unit.isZero(0.5)) return std::nullopt;
  return unit;
}

/// The result with its faces and edges over the first of coincident vertices, or nothing if no vertices coincide.
std::optional<LabelledMesh> over_first_vertices(const LabelledMesh& result) {
  const std::vector<Vec3>& positions = result.mesh.positions;
  PositionIndex index;
  index.reserve(positions.size(), positions);
  std::vector<Index> first(positions.size());
  bool coincide = false;
  for (Index vertex = 0; vertex < positions.size(); ++vertex) {
    first[vertex] = index.find_or_add(positions, vertex);
    coincide = coincide || first[vertex] != vertex;
  }
  if (!coincide) return std::nullopt;
  LabelledMesh welded{result.mesh, result.edges, result.labels, {}};
  for (Triangle& triangle : welded.mesh.triangles) {
    for (Index& corner : triangle) corner = first[corner];
  }
  for (Edge& edge : welded.edges) edge = {first[edge.v0], first[edge.v1]};
  return welded;
}

std::vector<std::array<Vec3, 3>> normals_by_fans(const LabelledMesh& result) {
  const IndexRows ridges = ridge_ends(result);
  const CornerRows rows(result.mesh);
  std::vector<std::array<Vec3, 3>> normals(result.mesh.triangles.size());
  std::vector<Corner> corners;
  std::vector<Vec3> fan_areas;
  FanFinder finder;
  for (Index vertex = 0; vertex < result.mesh.positions.size(); ++vertex) {
    rows.read(vertex, corners);
    const std::vector<std::size_t>& fans = finder.find(vertex, corners, ridges[vertex], {});
    fan_areas.assign(corners.size(), Vec3::Zero());
    for (std::size_t i = 0; i < corners.size(); ++i) {
      fan_areas[fans[i]] += area_vector(result.mesh.positions, result.mesh.triangles[corners[i].face]);
    }
    for (std::size_t i = 0; i < corners.size(); ++i) {
      normals[corners[i].face][corners[i].place] = unit_of(fan_areas[fans[i]]).value_or(Vec3::UnitZ());
    }
  }
  return normals;
}

}  // namespace

std::vector<std::array<Vec3, 3>> corner_normals(const LabelledMesh& result) {
  const std::optional<LabelledMesh> welded = over_first_vertices(result);
  return normals_by_fans(welded ? *welded : result);
}

NormalMeans::NormalMeans(const LabelledMesh& result, std::size_t count)
    : mesh_(&result.mesh), corners_(corner_normals(result)), sums_(count, Vec3::Zero()) {}

void NormalMeans::add(std::size_t number, std::size_t face, std::size_t place) {
  sums_[number] += area_vector(mesh_->positions, mesh_->triangles[face]).norm() * corners_[face][place];
}

void NormalMeans::add_vertices() {
  for (std::size_t face = 0; face < mesh_->triangles.size(); ++face) {
    for (std::size_t place = 0; place < 3; ++place) add(mesh_->triangles[face][place], face, place);
  }
}

std::optional<Vec3> NormalMeans::operator[](std::size_t number) const { return unit_of(sums_[number]); }

std::optional<Vec3> face_normal(const Mesh& mesh, std::size_t first, std::size_t count) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t face = first; face < first + count; ++face) {
    sum += area_vector(mesh.positions, mesh.triangles[face]);
  }
  return unit_of(sum);
}

}  // namespace crease
