#include <algorithm>

#include "core/error.h"
#include "core/io/gltf.h"
#include "core/io/gltf_builder.h"
#include "core/io/write_gltf_corners.h"

namespace crease {
namespace {

std::vector<float> single_normals(const std::vector<Vec3>& normals) {
  std::vector<float> values;
  values.reserve(3 * normals.size());
  for (const Vec3& normal : normals) {
    for (const double coordinate : normal) values.push_back(static_cast<float>(coordinate));
  }
  return values;
}

/// The numbers of the vertices `source`.
template <typename Number>
std::vector<float> numbers_of(const std::vector<Number>& numbers, const std::vector<Index>& source) {
  std::vector<float> values;
  values.reserve(source.size());
  for (const Index vertex : source) values.push_back(static_cast<float>(numbers[vertex]));
  return values;
}

std::vector<float> vertex_labels(const LabelledMesh& result, const std::vector<Index>& source) {
  std::vector<float> largest(result.mesh.positions.size(), 0);
  for (std::size_t edge = 0; edge < result.edges.size(); ++edge) {
    const auto label = static_cast<float>(result.labels[edge]);
    for (const Index vertex : {result.edges[edge].v0, result.edges[edge].v1}) {
      largest[vertex] = std::max(largest[vertex], label);
    }
  }
  return numbers_of(largest, source);
}

std::vector<float> vertex_segments(const LabelledMesh& result, const SplitMesh& split) {
  std::vector<float> values(split.source.size(), -1);
  for (std::size_t face = 0; face < split.triangles.size(); ++face) {
    if (result.segments[face] == kNone) continue;
    for (const Index vertex : split.triangles[face]) values[vertex] = static_cast<float>(result.segments[face]);
  }
  return values;
}

std::vector<Index> ridge_line_indices(const LabelledMesh& result) {
  std::vector<Index> indices;
  for (std::size_t edge = 0; edge < result.edges.size(); ++edge) {
    if (!is_ridge(result.labels[edge])) continue;
    indices.push_back(result.edges[edge].v0);
    indices.push_back(result.edges[edge].v1);
  }
  return indices;
}

std::vector<Index> flattened(const std::vector<Triangle>& triangles) {
  std::vector<Index> indices;
  indices.reserve(3 * triangles.size());
  for (const Triangle& triangle : triangles) indices.insert(indices.end(), triangle.begin(), triangle.end());
  return indices;
}

tinygltf::Mesh add_mesh(GltfBuilder& builder, const LabelledMesh& result) {
  const SplitMesh split = split_along_ridges(result);
  check_gltf_vertices(split.source.size(), split.source.size() - result.mesh.positions.size());
  builder.reserve(40 * split.source.size() + 12 * split.triangles.size());
  const std::vector<float> sources(split.source.begin(), split.source.end());

  tinygltf::Primitive faces;
  faces.mode = TINYGLTF_MODE_TRIANGLES;
  faces.attributes["POSITION"] = builder.add_positions(result.mesh, split.source);
  faces.attributes["NORMAL"] = builder.add_floats(TINYGLTF_TYPE_VEC3, 3, single_normals(split.normals));
  faces.attributes["_LABEL"] = builder.add_scalars(vertex_labels(result, split.source));
  faces.attributes["_SOURCE"] = builder.add_scalars(sources);
  if (!result.classes.empty())
    faces.attributes["_CLASS"] = builder.add_scalars(numbers_of(result.classes, split.source));
  if (!result.sigma.empty()) faces.attributes["_SIGMA"] = builder.add_scalars(numbers_of(result.sigma, split.source));
  if (!result.segments.empty()) faces.attributes["_SEGMENT"] = builder.add_scalars(vertex_segments(result, split));
  faces.indices = builder.add_indices(flattened(split.triangles));
  faces.material = builder.add_surface_material();

  tinygltf::Mesh mesh;
  mesh.primitives.push_back(faces);
  if (const std::vector<Index> indices = ridge_line_indices(result); !indices.empty()) {
    tinygltf::Primitive lines;
    lines.mode = TINYGLTF_MODE_LINE;
    lines.attributes["POSITION"] = faces.attributes["POSITION"];
    lines.attributes["_LABEL"] = faces.attributes["_LABEL"];
    lines.indices = builder.add_indices(indices);
    lines.material = builder.add_ridge_material();
    mesh.primitives.push_back(lines);
  }
  return mesh;
}

std::string write_file(const LabelledMesh& result, const nlohmann::ordered_json& extras, bool binary) {
  if (result.mesh.triangles.empty()) throw Error(code::kMeshNoFaces, "glTF cannot hold a mesh without faces");
  GltfBuilder builder;
  tinygltf::Mesh mesh = add_mesh(builder, result);
  return builder.write(std::move(mesh), extras, binary);
}

}  // namespace

std::string write_gltf(const LabelledMesh& result, const nlohmann::ordered_json& extras) {
  return write_file(result, extras, false);
}

std::string write_glb(const LabelledMesh& result, const nlohmann::ordered_json& extras) {
  return write_file(result, extras, true);
}

}  // namespace crease
