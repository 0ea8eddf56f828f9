#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <limits>
#include <sstream>

#include "core/error.h"
#include "core/io/write_formats.h"
#include "core/io/write_gltf_corners.h"
#include "core/io/write_number.h"

namespace crease {
namespace {

/// Vertex attributes cannot be 32-bit integers in glTF; a float holds integers exactly up to here.
constexpr std::size_t kMaxVertices = std::size_t{1} << 24;

tinygltf::Value to_value(const nlohmann::ordered_json& json) {
  if (json.is_object()) {
    tinygltf::Value::Object object;
    for (const auto& [name, member] : json.items()) object[name] = to_value(member);
    return tinygltf::Value(std::move(object));
  }
  if (json.is_array()) {
    tinygltf::Value::Array array;
    for (const auto& item : json) array.push_back(to_value(item));
    return tinygltf::Value(std::move(array));
  }
  if (json.is_boolean()) return tinygltf::Value(json.get<bool>());
  if (json.is_string()) return tinygltf::Value(json.get<std::string>());
  if (json.is_number_integer()) {
    const double value = json.get<double>();
    const bool fits = std::abs(value) <= std::numeric_limits<int>::max();
    return fits ? tinygltf::Value(json.get<int>()) : tinygltf::Value(value);
  }
  return json.is_number() ? tinygltf::Value(json.get<double>()) : tinygltf::Value();
}

/// Collects accessors over one buffer, each with a view of its own.
class GltfBuilder {
 public:
  GltfBuilder() { model_.buffers.emplace_back(); }

  void reserve(std::size_t bytes) { data().reserve(bytes); }

  /// Components of floats; `extent` writes the smallest and largest value of each, as positions need.
  int add_floats(int type, int components, const std::vector<float>& values, bool extent = false) {
    tinygltf::Accessor accessor;
    accessor.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
    accessor.type = type;
    accessor.count = values.size() / static_cast<std::size_t>(components);
    if (extent) {
      accessor.minValues.assign(values.begin(), values.begin() + components);
      accessor.maxValues = accessor.minValues;
      for (std::size_t i = 0; i < values.size(); ++i) {
        const std::size_t k = i % static_cast<std::size_t>(components);
        accessor.minValues[k] = std::min(accessor.minValues[k], static_cast<double>(values[i]));
        accessor.maxValues[k] = std::max(accessor.maxValues[k], static_cast<double>(values[i]));
      }
    }
    return add(std::move(accessor), values, TINYGLTF_TARGET_ARRAY_BUFFER);
  }

  int add_indices(const std::vector<Index>& values) {
    tinygltf::Accessor accessor;
    accessor.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    accessor.type = TINYGLTF_TYPE_SCALAR;
    accessor.count = values.size();
    return add(std::move(accessor), values, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
  }

  tinygltf::Model& model() { return model_; }

 private:
  std::vector<unsigned char>& data() { return model_.buffers.front().data; }

  template <typename Item>
  int add(tinygltf::Accessor accessor, const std::vector<Item>& values, int target) {
    static_assert(sizeof(Item) == 4);
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = data().size();
    view.byteLength = 4 * values.size();
    view.target = target;
    model_.bufferViews.push_back(view);
    for (const Item value : values) append_little_endian(data(), value);
    accessor.bufferView = static_cast<int>(model_.bufferViews.size()) - 1;
    model_.accessors.push_back(std::move(accessor));
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  tinygltf::Model model_;
};

std::vector<float> single_positions(const Mesh& mesh, const std::vector<Index>& source) {
  std::vector<float> values;
  values.reserve(3 * source.size());
  for (const Index vertex : source) {
    const std::array<float, 3> position = to_single(mesh.positions[vertex], vertex);
    values.insert(values.end(), position.begin(), position.end());
  }
  return values;
}

std::vector<float> single_normals(const std::vector<Vec3>& normals) {
  std::vector<float> values;
  values.reserve(3 * normals.size());
  for (const Vec3& normal : normals) {
    for (const double coordinate : normal) values.push_back(static_cast<float>(coordinate));
  }
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
  std::vector<float> values;
  values.reserve(source.size());
  for (const Index vertex : source) values.push_back(largest[vertex]);
  return values;
}

std::vector<Index> ridge_line_indices(const LabelledMesh& result) {
  std::vector<Index> indices;
  for (std::size_t edge = 0; edge < result.edges.size(); ++edge) {
    if (result.labels[edge] < kRidgeThreshold) continue;
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
  if (split.source.size() > kMaxVertices) {
    throw Error(code::kMeshUnsupported,
                fmt::format("{} vertices, {} of them copies along ridges, but glTF is written "
                            "for at most {}",
                            split.source.size(), split.source.size() - result.mesh.positions.size(), kMaxVertices));
  }
  builder.reserve(32 * split.source.size() + 12 * split.triangles.size());
  const std::vector<float> sources(split.source.begin(), split.source.end());

  tinygltf::Primitive faces;
  faces.mode = TINYGLTF_MODE_TRIANGLES;
  faces.attributes["POSITION"] =
      builder.add_floats(TINYGLTF_TYPE_VEC3, 3, single_positions(result.mesh, split.source), true);
  faces.attributes["NORMAL"] = builder.add_floats(TINYGLTF_TYPE_VEC3, 3, single_normals(split.normals));
  faces.attributes["_LABEL"] = builder.add_floats(TINYGLTF_TYPE_SCALAR, 1, vertex_labels(result, split.source));
  faces.attributes["_SOURCE"] = builder.add_floats(TINYGLTF_TYPE_SCALAR, 1, sources);
  faces.indices = builder.add_indices(flattened(split.triangles));

  tinygltf::Mesh mesh;
  mesh.primitives.push_back(faces);
  if (const std::vector<Index> indices = ridge_line_indices(result); !indices.empty()) {
    tinygltf::Primitive lines;
    lines.mode = TINYGLTF_MODE_LINE;
    lines.attributes["POSITION"] = faces.attributes["POSITION"];
    lines.attributes["_LABEL"] = faces.attributes["_LABEL"];
    lines.indices = builder.add_indices(indices);
    mesh.primitives.push_back(lines);
  }
  return mesh;
}

}  // namespace

std::string write_gltf(const LabelledMesh& result, const nlohmann::ordered_json& extras, bool binary) {
  if (result.mesh.triangles.empty()) throw Error(code::kMeshNoFaces, "glTF cannot hold a mesh without faces");
  GltfBuilder builder;
  tinygltf::Model& model = builder.model();
  model.asset.version = "2.0";
  model.asset.generator = "creased " CREASE_VERSION;
  if (extras.is_object()) model.asset.extras = to_value(extras);
  model.meshes.push_back(add_mesh(builder, result));
  model.nodes.emplace_back();
  model.nodes.back().mesh = 0;
  model.scenes.emplace_back();
  model.scenes.back().nodes.push_back(0);
  model.defaultScene = 0;

  std::ostringstream bytes;
  if (!tinygltf::TinyGLTF().WriteGltfSceneToStream(&model, bytes, false, binary)) {
    throw Error(code::kMeshTooLarge, "the mesh does not fit into a glTF file");
  }
  return std::move(bytes).str();
}

}  // namespace crease
