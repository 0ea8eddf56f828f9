#include "core/io/write_gltf_corners.h"

#include <numeric>

#include "core/io/corner_fans.h"
#include "core/io/corner_normals.h"

namespace crease {

SplitMesh split_along_ridges(const LabelledMesh& result) {
  const Mesh& mesh = result.mesh;
  const std::vector<std::array<Vec3, 3>> normals = corner_normals(result);
  const IndexRows ridges = ridge_ends(result);
  const CornerRows rows(mesh);

  SplitMesh split;
  split.triangles = mesh.triangles;
  split.source.resize(mesh.positions.size());
  std::iota(split.source.begin(), split.source.end(), Index{0});
  split.normals.assign(mesh.positions.size(), Vec3::UnitZ());

  std::vector<Corner> corners;
  std::vector<Index> vertex_of_part;
  FanFinder finder;
  for (Index vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    rows.read(vertex, corners);
    const std::vector<std::size_t>& parts = finder.find(vertex, corners, ridges[vertex], result.segments);
    vertex_of_part.assign(corners.size(), kNone);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      Index& part_vertex = vertex_of_part[parts[i]];
      if (part_vertex == kNone && i == 0) part_vertex = vertex;
      if (part_vertex == kNone) {
        part_vertex = static_cast<Index>(split.source.size());
        split.source.push_back(vertex);
        split.normals.emplace_back(Vec3::UnitZ());
      }
      split.triangles[corners[i].face][corners[i].place] = part_vertex;
      split.normals[part_vertex] = normals[corners[i].face][corners[i].place];
    }
  }
  return split;
}

}  // namespace crease
