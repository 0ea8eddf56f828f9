#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <span>

#include "core/error.h"
#include "core/io/gltf.h"
#include "core/io/gltf_builder.h"
#include "core/io/write_gltf_corners.h"

namespace crease {
namespace {

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

std::vector<Index> flattened(std::span<const Triangle> triangles) {
  std::vector<Index> indices;
  indices.reserve(3 * triangles.size());
  for (const Triangle& triangle : triangles) indices.insert(indices.end(), triangle.begin(), triangle.end());
  return indices;
}

/// The values of a layer for each vertex of the file; `otherwise` where no face has any.
template <std::size_t N>
std::vector<std::array<float, N>> values_of(const CornerValues<N>& layer, std::vector<std::array<float, N>> values,
                                            const Mesh& mesh, const SplitMesh& split,
                                            const std::array<float, N>& otherwise) {
  std::vector<std::array<float, N>> of_vertices(split.source.size(), otherwise);
  if (layer.corners.empty()) {
    for (std::size_t v = 0; v < of_vertices.size(); ++v) of_vertices[v] = values[split.source[v]];
    return of_vertices;
  }
  for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index number = layer.corners[face][k];
      if (number != kNone) of_vertices[split.triangles[face][k]] = values[number];
    }
  }
  return of_vertices;
}

/// Writes a result with what glTF keeps of the look of its upload.
class GltfWriter {
 public:
  GltfWriter(const LabelledMesh& result, const MeshStyle& style)
      : result_(result),
        look_(result.appearance),
        split_(split_along_ridges(result, corner_looks(look_))),
        builder_(style) {
    check_gltf_vertices(split_.source.size(), split_.source.size() - result.mesh.positions.size());
    builder_.reserve(40 * split_.source.size() + 12 * split_.triangles.size());
  }

  std::string write(const nlohmann::ordered_json& extras, bool binary) {
    add_attributes();
    builder_.add_parts(look_.gltf);
    Json primitives = Json::array();
    add_faces(primitives);
    if (const std::vector<Index> indices = ridge_line_indices(result_); !indices.empty()) {
      primitives.push_back({{"mode", kLines},
                            {"attributes", {{"POSITION", attributes_["POSITION"]}, {"_LABEL", attributes_["_LABEL"]}}},
                            {"indices", builder_.add_indices(indices)},
                            {"material", builder_.add_material(ridge_material())}});
    }
    return builder_.write(std::move(primitives), extras, binary);
  }

 private:
  using Json = GltfBuilder::Json;
  static constexpr int kLines = 1, kTriangles = 4;

  void add_attributes() {
    const std::vector<Index>& source = split_.source;
    attributes_["POSITION"] = builder_.add_positions(result_.mesh, source);
    attributes_["NORMAL"] = builder_.add_normals(split_.normals);
    if (!look_.colours.empty()) {
      attributes_["COLOR_0"] = builder_.add_colours(
          values_of<4>(look_.colours, colours_of(look_, true), result_.mesh, split_, {1, 1, 1, 1}));
    }
    for (std::size_t set = 0; set < look_.texture.size(); ++set) {
      const auto values = values_of<2>(look_.texture[set], texture_of(look_, set, true), result_.mesh, split_, {0, 0});
      std::vector<float> numbers;
      numbers.reserve(2 * values.size());
      for (const auto& [u, v] : values) numbers.insert(numbers.end(), {u, v});
      attributes_[fmt::format("TEXCOORD_{}", set)] = builder_.add_floats(numbers, 2);
    }
    attributes_["_LABEL"] = builder_.add_floats(vertex_labels(result_, source));
    attributes_["_SOURCE"] = builder_.add_floats({source.begin(), source.end()});
    if (!result_.classes.empty()) attributes_["_CLASS"] = builder_.add_floats(numbers_of(result_.classes, source));
    if (!result_.sigma.empty()) attributes_["_SIGMA"] = builder_.add_floats(numbers_of(result_.sigma, source));
    if (!result_.segments.empty()) attributes_["_SEGMENT"] = builder_.add_floats(vertex_segments(result_, split_));
  }

  /// Adds a primitive for each run of faces with the same material, so that the faces keep their order.
  void add_faces(Json& primitives) {
    const std::vector<MaterialRun> runs = covering_runs(look_, split_.triangles.size());
    if (runs.size() > kMostRuns) {
      throw Error(code::kMeshUnsupported,
                  fmt::format("the material changes {} times along the faces; glTF is written with at most {} parts",
                              runs.size() - 1, kMostRuns));
    }
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const std::size_t first = runs[i].first_face;
      const std::size_t end = i + 1 < runs.size() ? runs[i + 1].first_face : split_.triangles.size();
      const std::span<const Triangle> faces(split_.triangles.data() + first, end - first);
      primitives.push_back({{"mode", kTriangles},
                            {"attributes", attributes_},
                            {"indices", builder_.add_indices(flattened(faces))},
                            {"material", material_of(runs[i].material)}});
    }
  }

  /// The number in the file of a material of the upload, or of the surface without any.
  std::size_t material_of(Index material) {
    const auto [known, is_new] = materials_.try_emplace(material, 0);
    if (!is_new) return known->second;
    Json written = surface_material(!look_.colours.empty());
    if (material != kNone) {
      const std::string& of_upload = look_.materials.at(material).json;
      if (of_upload.empty()) {
        written["name"] = name_of(look_, material);
      } else {
        written = Json::parse(of_upload);
      }
    }
    return known->second = builder_.add_material(std::move(written));
  }

  static constexpr std::size_t kMostRuns = 1U << 16U;

  const LabelledMesh& result_;
  const Appearance& look_;
  SplitMesh split_;
  GltfBuilder builder_;
  Json attributes_;
  std::map<Index, std::size_t> materials_;
};

std::string write_file(const LabelledMesh& result, const nlohmann::ordered_json& extras, const MeshStyle& style,
                       bool binary) {
  if (result.mesh.triangles.empty()) throw Error(code::kMeshNoFaces, "glTF cannot hold a mesh without faces");
  return GltfWriter(result, style).write(extras, binary);
}

}  // namespace

std::string write_gltf(const LabelledMesh& result, const nlohmann::ordered_json& extras, const MeshStyle& style) {
  return write_file(result, extras, style, false);
}

std::string write_glb(const LabelledMesh& result, const nlohmann::ordered_json& extras, const MeshStyle& style) {
  return write_file(result, extras, style, true);
}

}  // namespace crease
