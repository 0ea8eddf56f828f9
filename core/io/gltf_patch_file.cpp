#include "core/io/gltf_patch_file.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "core/io/base64.h"
#include "core/io/glb.h"
#include "core/io/write_number.h"

namespace crease {
namespace {

using gltf::Accessor;
using gltf::Component;
using OrderedJson = nlohmann::ordered_json;

/// The vectors as elements of an accessor. Integers are normalised.
std::string packed(const std::vector<Vec3>& values, Component component) {
  std::string bytes;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::array<float, 3> vector = to_single(values[i], i);
    for (std::size_t k = 0; k < 3; ++k) {
      if (component == Component::kInt8) {
        append_little_endian(bytes, static_cast<std::int8_t>(std::lround(127 * vector[k])));
      } else if (component == Component::kInt16) {
        append_little_endian(bytes, static_cast<std::int16_t>(std::lround(32767 * vector[k])));
      } else {
        append_little_endian(bytes, vector[k]);
      }
    }
  }
  return bytes;
}

bool holds_vectors(const Accessor& accessor, bool are_positions) {
  if (accessor.elements.data == nullptr || accessor.sparse_indices.count != 0) return false;
  const Component component = accessor.elements.component;
  const bool is_small = component == Component::kInt8 || component == Component::kInt16;
  return component == Component::kFloat || (!are_positions && accessor.normalized && is_small);
}

/// Positions must have their extent, in single precision.
void set_extent(OrderedJson& accessor, const std::vector<Vec3>& values) {
  Eigen::AlignedBox3f box;
  for (const Vec3& value : values) box.extend(value.cast<float>());
  accessor["min"] = {box.min().x(), box.min().y(), box.min().z()};
  accessor["max"] = {box.max().x(), box.max().y(), box.max().z()};
}

}  // namespace

GltfPatchFile::GltfPatchFile(const gltf::Document& document)
    : document_(document), json_(OrderedJson::parse(document.json_text())) {
  drop_draco();
  if (json_.contains("meshes")) meshes_ = json_["meshes"];
}

/// What was compressed would still have the old positions: the accessors get the decoded data instead.
void GltfPatchFile::drop_draco() {
  if (document_.from_draco().empty()) return;
  for (OrderedJson& mesh : json_["meshes"]) {
    for (OrderedJson& primitive : mesh["primitives"]) {
      if (!primitive.contains("extensions")) continue;
      primitive["extensions"].erase(gltf::kDraco);
      if (primitive["extensions"].empty()) primitive.erase("extensions");
    }
  }
  drop_extension(gltf::kDraco);
}

/// Takes a name from the lists of extensions.
void GltfPatchFile::drop_extension(const char* name) {
  for (const char* list : {"extensionsUsed", "extensionsRequired"}) {
    if (!json_.contains(list)) continue;
    OrderedJson& names = json_[list];
    names.erase(std::remove(names.begin(), names.end(), name), names.end());
    if (names.empty()) json_.erase(list);
  }
}

/// Gives the decoded data to the accessors that primitives still have.
void GltfPatchFile::store_decoded() {
  std::set<std::size_t> used;
  for (const OrderedJson& mesh : json_["meshes"]) {
    for (const OrderedJson& primitive : mesh["primitives"]) {
      for (const auto& [name, accessor] : primitive["attributes"].items()) used.insert(accessor.get<std::size_t>());
      if (primitive.contains("indices")) used.insert(primitive["indices"].get<std::size_t>());
    }
  }
  for (const auto& [accessor, data] : document_.from_draco()) {
    if (!used.contains(accessor)) continue;
    json_["accessors"][accessor]["bufferView"] = append_view(data);
  }
}

std::vector<Vec3> GltfPatchFile::vectors(std::size_t index) const {
  const Accessor accessor = document_.accessor(index, fmt::format("accessor {}", index));
  if (accessor.components != 3) throw Error(code::kMeshSyntax, "the type must be VEC3", accessor.place);
  std::vector<Vec3> values(accessor.count());
  gltf::for_each_element(
      accessor, [&](std::size_t element, const char* bytes) { values[element] = gltf::load_vector(bytes, accessor); });
  return values;
}

std::size_t GltfPatchFile::store(std::size_t index, const std::vector<Vec3>& values, bool are_positions) {
  const Accessor accessor = document_.accessor(index, fmt::format("accessor {}", index));
  const Component component = accessor.elements.component;
  if (!holds_vectors(accessor, are_positions) ||
      !overwrite(accessor.elements, 3 * size_of(component), packed(values, component))) {
    return append(index, values, are_positions);
  }
  if (are_positions) set_extent(json_["accessors"][index], values);
  return index;
}

GltfPatchFile::Copy& GltfPatchFile::copy_of(std::size_t buffer) {
  Copy& copy = copies_[buffer];
  if (copy.bytes.empty()) {
    copy.bytes = document_.buffers()[buffer];
    copy.written.resize(copy.bytes.size(), false);
  }
  return copy;
}

bool GltfPatchFile::overwrite(const gltf::Elements& elements, std::size_t element_bytes, const std::string& values) {
  const auto& buffers = document_.buffers();
  const auto found = std::ranges::find_if(buffers, [&](std::string_view buffer) {
    return std::less_equal<>()(buffer.data(), elements.data) &&
           std::less<>()(elements.data, buffer.data() + buffer.size());
  });
  if (found == buffers.end()) return false;
  Copy& copy = copy_of(static_cast<std::size_t>(found - buffers.begin()));
  const auto start = static_cast<std::size_t>(elements.data - found->data());
  const auto place_of = [&](std::size_t i) { return start + i / element_bytes * elements.stride + i % element_bytes; };
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (copy.written[place_of(i)] && copy.bytes[place_of(i)] != values[i]) return false;
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    copy.bytes[place_of(i)] = values[i];
    copy.written[place_of(i)] = true;
  }
  return true;
}

std::size_t GltfPatchFile::buffer_to_extend() const {
  for (std::size_t buffer = 0; buffer < document_.buffers().size(); ++buffer) {
    if (document_.is_binary_chunk(buffer) || json_["buffers"][buffer].contains("uri")) return buffer;
  }
  throw Error(code::kMeshUnsupported, "the file has no buffer for new positions", "buffers");
}

std::size_t GltfPatchFile::append(std::size_t index, const std::vector<Vec3>& values, bool are_positions) {
  OrderedJson accessor = json_["accessors"][index];
  for (const char* member : {"sparse", "byteOffset", "normalized", "min", "max"}) accessor.erase(member);
  accessor["bufferView"] = append_view(packed(values, Component::kFloat));
  json_["bufferViews"].back()["target"] = gltf::Target::kVertexData;
  accessor["componentType"] = Component::kFloat;
  if (are_positions) set_extent(accessor, values);
  json_["accessors"].push_back(std::move(accessor));
  return json_["accessors"].size() - 1;
}

std::size_t GltfPatchFile::append_view(const std::string& data) {
  const std::size_t buffer = buffer_to_extend();
  std::string& bytes = copy_of(buffer).bytes;
  pad_chunk(bytes, '\0');
  json_["bufferViews"].push_back({{"buffer", buffer}, {"byteOffset", bytes.size()}, {"byteLength", data.size()}});
  bytes += data;
  json_["buffers"][buffer]["byteLength"] = bytes.size();
  return json_["bufferViews"].size() - 1;
}

void GltfPatchFile::set_mesh(const gltf::MeshInstance& instance, OrderedJson mesh) {
  std::vector<std::size_t>& variants = variants_[instance.mesh];
  auto found = std::ranges::find_if(variants, [&](std::size_t number) { return json_["meshes"][number] == mesh; });
  if (found == variants.end()) {
    if (variants.empty()) {
      json_["meshes"][instance.mesh] = std::move(mesh);
      variants.push_back(instance.mesh);
    } else {
      variants.push_back(json_["meshes"].size());
      json_["meshes"].push_back(std::move(mesh));
    }
    found = variants.end() - 1;
  }
  if (instance.is_copy) {
    meshes_of_copies_[instance.node.value()].push_back(*found);
  } else if (*found != instance.mesh) {
    json_["nodes"][instance.node.value()]["mesh"] = *found;
  }
}

/// Gives the copies of a node these meshes: as nodes of their own, unless they all have the same one.
void GltfPatchFile::place_copies(std::size_t number, const std::vector<std::size_t>& meshes) {
  OrderedJson node = json_["nodes"][number];
  if (std::ranges::count(meshes, meshes.front()) == static_cast<std::ptrdiff_t>(meshes.size())) {
    json_["nodes"][number]["mesh"] = meshes.front();
    return;
  }
  const std::string place = fmt::format("node {}", number);
  const auto copies = copies_of(document_, document_.entry("nodes", number, place), kNoLimits, place);
  for (std::size_t i = 0; i < copies.size(); ++i) {
    const auto& [translation, rotation, scale] = copies[i];
    OrderedJson child{{"mesh", meshes[i]},
                      {"translation", {translation.x(), translation.y(), translation.z()}},
                      {"rotation", {rotation.x(), rotation.y(), rotation.z(), rotation.w()}},
                      {"scale", {scale.x(), scale.y(), scale.z()}}};
    if (node.contains("weights")) child["weights"] = node["weights"];
    node["children"].push_back(json_["nodes"].size());
    json_["nodes"].push_back(std::move(child));
  }
  node.erase("mesh");
  node.erase("weights");
  node["extensions"].erase(gltf::kInstancing);
  if (node["extensions"].empty()) node.erase("extensions");
  json_["nodes"][number] = std::move(node);
}

std::string GltfPatchFile::finish(std::string_view upload) {
  if (!document_.from_draco().empty()) store_decoded();
  for (const auto& [node, meshes] : meshes_of_copies_) place_copies(node, meshes);
  const auto has_copies = [](const OrderedJson& node) {
    return node.contains("extensions") && node["extensions"].contains(gltf::kInstancing);
  };
  if (!meshes_of_copies_.empty() && std::ranges::none_of(json_["nodes"], has_copies)) {
    drop_extension(gltf::kInstancing);
  }
  for (const auto& [buffer, copy] : copies_) {
    if (document_.is_binary_chunk(buffer)) continue;
    auto& uri = json_["buffers"][buffer]["uri"];
    std::string head = uri.get_ref<const std::string&>();
    head.resize(head.find(','));
    if (!head.ends_with(";base64")) head += ";base64";
    uri = head + ',' + encode_base64(copy.bytes);
  }
  return document_.is_binary() ? finish_glb(upload) : finish_gltf(upload);
}

std::string GltfPatchFile::finish_gltf(std::string_view upload) const {
  const bool has_lines = upload.find('\n') < upload.find_last_not_of(" \t\r\n");
  return json_.dump(has_lines ? 2 : -1) + (upload.ends_with('\n') ? "\n" : "");
}

std::string GltfPatchFile::finish_glb(std::string_view upload) const {
  constexpr std::size_t kHeadBytes = 12, kChunkHeadBytes = 8;
  const auto changed =
      std::ranges::find_if(copies_, [&](const auto& copy) { return document_.is_binary_chunk(copy.first); });
  std::string chunks;
  const std::size_t end = upload.size() - document_.trailing_bytes();
  for (ByteCursor cursor(upload.substr(0, end), kHeadBytes); cursor.rest() >= kChunkHeadBytes;) {
    const std::size_t size = cursor.read<std::uint32_t>();
    const auto type = cursor.read<std::uint32_t>();
    std::string chunk(cursor.take(size), size);
    if (chunks.empty()) {
      chunk = json_.dump();
      pad_chunk(chunk, ' ');
    } else if (changed != copies_.end() &&
               upload.data() + (cursor.offset() - size) == document_.buffers()[changed->first].data()) {
      chunk = changed->second.bytes;
      pad_chunk(chunk, '\0');
    }
    append_chunk(chunks, chunk, type);
  }
  std::string file(upload.substr(0, 8));
  append_little_endian(file, static_cast<std::uint32_t>(kHeadBytes + chunks.size()));
  file += chunks;
  file += upload.substr(end);
  return file;
}

}  // namespace crease
