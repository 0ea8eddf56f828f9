#include "core/io/gltf_builder.h"

#include <fmt/format.h>
#include <meshoptimizer.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.h"
#include "core/io/base64.h"
#include "core/io/glb.h"
#include "core/io/gltf_terms.h"
#include "core/io/write_number.h"

namespace crease {
namespace {

using gltf::Component;
using gltf::kMeshopt;
using OrderedJson = nlohmann::ordered_json;

constexpr std::size_t kMaxVertices = std::size_t{1} << 24;
constexpr const char* kUnlit = "KHR_materials_unlit";
constexpr double kSteps = 65535;

/// The middle of a mesh where it lies so far away that single precision would round off much of it, or else 0.
Vec3 origin_of(const Eigen::AlignedBox3d& box) {
  constexpr double kFar = 32;  // times its size
  const double farthest = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
  return farthest > kFar * box.diagonal().norm() ? Vec3(box.min() / 2 + box.max() / 2) : Vec3::Zero();
}

/// "SCALAR", "VEC2", …
std::string type_of(std::size_t components) { return components == 1 ? "SCALAR" : fmt::format("VEC{}", components); }

OrderedJson accessor_of(Component component, std::size_t count, std::size_t components) {
  return {{"componentType", component}, {"count", count}, {"type", type_of(components)}};
}

/// The least and the largest of each component, as positions must have them.
template <typename Number>
void set_extent(OrderedJson& accessor, const std::vector<Number>& values) {
  std::array<Number, 3> least{values[0], values[1], values[2]}, most = least;
  for (std::size_t i = 0; i < values.size(); ++i) {
    least[i % 3] = std::min(least[i % 3], values[i]);
    most[i % 3] = std::max(most[i % 3], values[i]);
  }
  accessor["min"] = least;
  accessor["max"] = most;
}

/// Elements of `components` numbers, padded to a multiple of four bytes as vertex data must be.
template <typename Number>
std::string packed(const std::vector<Number>& values, std::size_t components) {
  const std::size_t size = components * sizeof(Number), padding = (4 - size % 4) % 4;
  std::string bytes;
  bytes.reserve(values.size() / components * (size + padding));
  for (std::size_t i = 0; i < values.size(); ++i) {
    append_little_endian(bytes, values[i]);
    if (i % components == components - 1) bytes.append(padding, '\0');
  }
  return bytes;
}

}  // namespace

std::size_t GltfBuilder::add(Json accessor, const Elements& elements) {
  accessor["bufferView"] = add_view(elements);
  json_["accessors"].push_back(std::move(accessor));
  return json_["accessors"].size() - 1;
}

std::size_t GltfBuilder::add_view(const Elements& elements) {
  Json view = {{"buffer", 0}, {"byteOffset", data_.size()}, {"byteLength", elements.bytes.size()}};
  if (!elements.are_indices && (style_.quantized || style_.compressed)) view["byteStride"] = elements.stride;
  view["target"] = elements.are_indices ? gltf::Target::kIndexData : gltf::Target::kVertexData;
  if (style_.compressed) {
    compress(elements, view);
  } else {
    data_ += elements.bytes;
  }
  json_["bufferViews"].push_back(std::move(view));
  return json_["bufferViews"].size() - 1;
}

/// Appends the elements as meshoptimizer compresses them. The order of vertices, faces and corners stays. The view then
/// belongs to the buffer that would have the plain bytes.
void GltfBuilder::compress(const Elements& elements, Json& view) {
  std::vector<unsigned char> encoded;
  std::size_t size = 0;
  if (elements.are_indices) {
    std::vector<unsigned int> indices(elements.count);
    std::memcpy(indices.data(), elements.bytes.data(), elements.bytes.size());
    const unsigned int largest = *std::ranges::max_element(indices);
    encoded.resize(meshopt_encodeIndexSequenceBound(elements.count, std::size_t{largest} + 1));
    size = meshopt_encodeIndexSequence(encoded.data(), encoded.size(), indices.data(), elements.count);
  } else {
    encoded.resize(meshopt_encodeVertexBufferBound(elements.count, elements.stride));
    size = meshopt_encodeVertexBuffer(encoded.data(), encoded.size(), elements.bytes.data(), elements.count,
                                      elements.stride);
  }
  view["buffer"] = 1;
  view["byteOffset"] = fallback_bytes_;
  view["extensions"][kMeshopt] = {{"buffer", 0},
                                  {"byteOffset", data_.size()},
                                  {"byteLength", size},
                                  {"byteStride", elements.stride},
                                  {"count", elements.count},
                                  {"mode", elements.are_indices ? "INDICES" : "ATTRIBUTES"}};
  fallback_bytes_ += elements.bytes.size();
  data_.append(reinterpret_cast<const char*>(encoded.data()), size);
  pad_chunk(data_, '\0');
}

std::size_t GltfBuilder::add_floats(const std::vector<float>& values, std::size_t components) {
  const std::size_t count = values.size() / components;
  return add(accessor_of(Component::kFloat, count, components), {packed(values, components), count, 4 * components});
}

std::size_t GltfBuilder::add_indices(const std::vector<Index>& values) {
  return add(accessor_of(Component::kUint32, values.size(), 1), {packed(values, 1), values.size(), 4, true});
}

std::size_t GltfBuilder::add_normals(const std::vector<Vec3>& normals) {
  if (!style_.quantized) {
    std::vector<float> values;
    values.reserve(3 * normals.size());
    for (const Vec3& normal : normals) {
      for (const double coordinate : normal) values.push_back(static_cast<float>(coordinate));
    }
    return add_floats(values, 3);
  }
  constexpr double kMost = 127;
  std::vector<std::int8_t> values;
  values.reserve(3 * normals.size());
  for (const Vec3& normal : normals) {
    for (const double coordinate : normal) values.push_back(static_cast<std::int8_t>(std::lround(kMost * coordinate)));
  }
  Json accessor = accessor_of(Component::kInt8, normals.size(), 3);
  accessor["normalized"] = true;
  return add(std::move(accessor), {packed(values, 3), normals.size(), 4});
}

std::size_t GltfBuilder::add_colours(const std::vector<Colour>& colours) {
  std::vector<std::uint16_t> steps;
  std::vector<float> values;
  for (const Colour& colour : colours) {
    for (const float part : colour) {
      if (style_.quantized) {
        steps.push_back(static_cast<std::uint16_t>(std::lround(kSteps * static_cast<double>(part))));
      } else {
        values.push_back(part);
      }
    }
  }
  if (!style_.quantized) return add_floats(values, 4);
  Json accessor = accessor_of(Component::kUint16, colours.size(), 4);
  accessor["normalized"] = true;
  return add(std::move(accessor), {packed(steps, 4), colours.size(), 8});
}

std::size_t GltfBuilder::add_positions(const Mesh& mesh, const std::vector<Index>& source) {
  Eigen::AlignedBox3d box;
  for (const Vec3& position : mesh.positions) box.extend(position);
  origin_ = style_.quantized ? box.min() : origin_of(box);
  std::vector<float> values;
  values.reserve(3 * source.size());
  for (const Index vertex : source) {
    const std::array<float, 3> position = to_single(mesh.positions[vertex] - origin_, vertex);
    values.insert(values.end(), position.begin(), position.end());
  }
  Json accessor = accessor_of(Component::kFloat, source.size(), 3);
  if (!style_.quantized) {
    set_extent(accessor, values);
    return add(std::move(accessor), {packed(values, 3), source.size(), 12});
  }
  use_extension(gltf::kQuantization, true);
  const double extent = box.sizes().maxCoeff();
  scale_ = extent > 0 ? extent / kSteps : 1;
  std::vector<std::uint16_t> steps;
  steps.reserve(values.size());
  for (const Index vertex : source) {
    for (const double coordinate : mesh.positions[vertex] - origin_) {
      steps.push_back(static_cast<std::uint16_t>(std::lround(coordinate / scale_)));
    }
  }
  accessor["componentType"] = Component::kUint16;
  set_extent(accessor, steps);
  return add(std::move(accessor), {packed(steps, 3), source.size(), 8});
}

std::size_t GltfBuilder::add_material(Json material) {
  if (material.contains("extensions") && material["extensions"].contains(kUnlit)) use_extension(kUnlit, false);
  json_["materials"].push_back(std::move(material));
  return json_["materials"].size() - 1;
}

void GltfBuilder::add_parts(const GltfParts& parts) {
  for (const std::string& name : parts.extensions_used) use_extension(name, false);
  for (const std::string& name : parts.extensions_required) use_extension(name, true);
  if (parts.textures.empty()) return;
  json_.update(Json::parse(parts.textures));
  if (!json_.contains("images")) return;
  const std::size_t first = json_["bufferViews"].size();
  for (const std::string& bytes : parts.images) {
    json_["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", data_.size()}, {"byteLength", bytes.size()}});
    data_ += bytes;
    pad_chunk(data_, '\0');
  }
  for (Json& image : json_["images"]) {
    if (image.contains("bufferView")) image["bufferView"] = first + image["bufferView"].get<std::size_t>();
  }
}

void GltfBuilder::use_extension(const std::string& name, bool required) {
  for (const char* list : {"extensionsUsed", "extensionsRequired"}) {
    if (list == std::string_view("extensionsRequired") && !required) continue;
    Json& names = json_[list];
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
}

std::string GltfBuilder::write(Json primitives, const nlohmann::ordered_json& extras, bool binary) {
  json_["asset"] = {{"version", "2.0"}, {"generator", "creased " CREASE_VERSION}};
  if (extras.is_object()) json_["asset"]["extras"] = extras;
  Json node = {{"name", "empty"}};
  if (!primitives.empty()) {
    node = {{"name", "result"}, {"mesh", 0}};
    if (origin_ != Vec3::Zero()) node["translation"] = {origin_.x(), origin_.y(), origin_.z()};
    if (scale_ != 1) node["scale"] = {scale_, scale_, scale_};
    json_["meshes"] = Json::array({{{"name", "result"}, {"primitives", std::move(primitives)}}});
  }
  json_["nodes"] = Json::array({std::move(node)});
  json_["scenes"] = Json::array({{{"nodes", Json::array({0})}}});
  json_["scene"] = 0;
  return finish(binary);
}

std::string GltfBuilder::finish(bool binary) {
  if (!data_.empty()) {
    json_["buffers"] = Json::array({{{"byteLength", data_.size()}}});
    if (!binary) json_["buffers"][0]["uri"] = "data:application/octet-stream;base64," + encode_base64(data_);
  }
  if (style_.compressed && !data_.empty()) {
    use_extension(kMeshopt, true);
    Json fallback = {{"byteLength", fallback_bytes_}};
    fallback["extensions"][kMeshopt] = {{"fallback", true}};
    json_["buffers"].push_back(std::move(fallback));
  }
  if (!binary) return json_.dump(2) + "\n";
  return glb_file(json_.dump(), data_);
}

OrderedJson surface_material(bool has_colours) {
  const OrderedJson grey = {0.6, 0.62, 0.65, 1}, white = {1, 1, 1, 1};
  return {{"name", "surface"},
          {"doubleSided", true},
          {"pbrMetallicRoughness",
           {{"baseColorFactor", has_colours ? white : grey}, {"metallicFactor", 0}, {"roughnessFactor", 0.9}}}};
}

OrderedJson ridge_material() {
  OrderedJson material = {{"name", "ridges"}, {"pbrMetallicRoughness", {{"baseColorFactor", {0.8, 0.05, 0.05, 1}}}}};
  material["extensions"][kUnlit] = OrderedJson::object();
  return material;
}

bool is_own_material(const nlohmann::json& material) {
  for (const OrderedJson& own : {surface_material(false), surface_material(true), ridge_material()}) {
    if (nlohmann::json(own) == material) return true;
  }
  return false;
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
