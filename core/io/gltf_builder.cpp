#include "core/io/gltf_builder.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <sstream>

#include "core/error.h"
#include "core/io/write_number.h"

namespace crease {
namespace {

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

/// The middle of a mesh where it lies so far away that single precision would round off much of it, or else 0.
Vec3 origin_of(const Mesh& mesh) {
  constexpr double kFar = 32;  // times its size
  if (mesh.positions.empty()) return Vec3::Zero();
  Eigen::AlignedBox3d box;
  for (const Vec3& position : mesh.positions) box.extend(position);
  const double farthest = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
  return farthest > kFar * box.diagonal().norm() ? Vec3(box.min() / 2 + box.max() / 2) : Vec3::Zero();
}

}  // namespace

template <typename Item>
int GltfBuilder::add(tinygltf::Accessor accessor, const std::vector<Item>& values, int target) {
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

int GltfBuilder::add_floats(int type, int components, const std::vector<float>& values, bool extent) {
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

int GltfBuilder::add_indices(const std::vector<Index>& values) {
  tinygltf::Accessor accessor;
  accessor.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  accessor.type = TINYGLTF_TYPE_SCALAR;
  accessor.count = values.size();
  return add(std::move(accessor), values, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
}

int GltfBuilder::add_positions(const Mesh& mesh, const std::vector<Index>& source) {
  origin_ = origin_of(mesh);
  std::vector<float> values;
  values.reserve(3 * source.size());
  for (const Index vertex : source) {
    const std::array<float, 3> position = to_single(mesh.positions[vertex] - origin_, vertex);
    values.insert(values.end(), position.begin(), position.end());
  }
  return add_floats(TINYGLTF_TYPE_VEC3, 3, values, true);
}

int GltfBuilder::add_surface_material() {
  tinygltf::Material& material = model_.materials.emplace_back();
  material.name = "surface";
  material.pbrMetallicRoughness.baseColorFactor = {0.6, 0.62, 0.65, 1};
  material.pbrMetallicRoughness.metallicFactor = 0;
  material.pbrMetallicRoughness.roughnessFactor = 0.9;
  material.doubleSided = true;
  return static_cast<int>(model_.materials.size()) - 1;
}

int GltfBuilder::add_ridge_material() {
  constexpr const char* kUnlit = "KHR_materials_unlit";
  tinygltf::Material& material = model_.materials.emplace_back();
  material.name = "ridges";
  material.pbrMetallicRoughness.baseColorFactor = {0.8, 0.05, 0.05, 1};
  material.extensions[kUnlit] = tinygltf::Value(tinygltf::Value::Object());
  model_.extensionsUsed = {kUnlit};
  return static_cast<int>(model_.materials.size()) - 1;
}

std::string GltfBuilder::write(tinygltf::Mesh mesh, const nlohmann::ordered_json& extras, bool binary) {
  model_.asset.version = "2.0";
  model_.asset.generator = "creased " CREASE_VERSION;
  if (extras.is_object()) model_.asset.extras = to_value(extras);
  model_.nodes.emplace_back();
  if (mesh.primitives.empty()) {
    model_.buffers.clear();
    model_.nodes.back().name = "empty";  // tinygltf writes a node without members as null
  } else {
    mesh.name = "result";
    model_.meshes.push_back(std::move(mesh));
    model_.nodes.back().mesh = 0;
    model_.nodes.back().name = "result";
    if (origin_ != Vec3::Zero()) model_.nodes.back().translation.assign(origin_.begin(), origin_.end());
  }
  model_.scenes.emplace_back();
  model_.scenes.back().nodes.push_back(0);
  model_.defaultScene = 0;

  std::ostringstream bytes;
  if (!tinygltf::TinyGLTF().WriteGltfSceneToStream(&model_, bytes, false, binary)) {
    throw Error(code::kMeshTooLarge, "the mesh is too large for a glTF file");
  }
  return std::move(bytes).str();
}

void check_gltf_vertices(std::size_t vertices, std::size_t copies) {
  if (vertices <= kMaxVertices) return;
  throw Error(
      code::kMeshUnsupported,
      fmt::format(
          "the file would have {} vertices ({} of them copies along ridges); glTF can be written with at most {}",
          vertices, copies, kMaxVertices));
}

}  // namespace crease
