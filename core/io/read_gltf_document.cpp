#include "core/io/read_gltf_document.h"

#include <algorithm>
#include <array>
#include <limits>

#include "core/base/text.h"
#include "core/io/base64.h"
#include "core/io/glb.h"
#include "core/io/gltf_compressed.h"
#include "core/io/gltf_draco.h"
#include "core/io/text_cursor.h"

namespace crease::gltf {
namespace {

Component component_member(const Json& object, const std::string& place) {
  const std::size_t value = size_member(object, "componentType", place);
  if (value < 5120 || value > 5126 || value == 5124) {
    throw Error(code::kMeshSyntax, fmt::format("component type {} does not exist", value), place);
  }
  return static_cast<Component>(value);
}

/// Whether the positions and faces of the default scene are the same without the extension: it concerns materials,
/// textures, light, sound, behaviour, meaning or metadata.
bool moves_no_vertex(std::string_view extension) {
  constexpr std::array<std::string_view, 28> kPrefixes{"AGI_",
                                                       "ASOBO_",
                                                       "GODOT_",
                                                       "GRIFFEL_",
                                                       "MOZ_",
                                                       "OMI_",
                                                       "KHR_materials_",
                                                       "EXT_materials_",
                                                       "ADOBE_materials_",
                                                       "NV_materials_",
                                                       "MSFT_materials_",
                                                       "VRMC_",
                                                       "KHR_texture_",
                                                       "EXT_texture_",
                                                       "MSFT_texture_",
                                                       "GOOGLE_texture_",
                                                       "KHR_lights_",
                                                       "EXT_lights_",
                                                       "FB_",
                                                       "KHR_audio",
                                                       "MSFT_audio",
                                                       "KHR_animation_",
                                                       "KHR_interactivity",
                                                       "KHR_xmp",
                                                       "EXT_structural_",
                                                       "EXT_feature_",
                                                       "EXT_mesh_features",
                                                       "KHR_physics_"};
  constexpr std::array<std::string_view, 13> kNames{"KHR_techniques_webgl",
                                                    "KHR_environment_map",
                                                    "EXT_mesh_manifold",
                                                    "EXT_mesh_primitive_edge_visibility",
                                                    "VRM",
                                                    "MSFT_packing_normalRoughnessMetallic",
                                                    "MSFT_packing_occlusionRoughnessMetallic",
                                                    "EXT_lights_ies",
                                                    "EXT_instance_features",
                                                    "KHR_node_hoverability",
                                                    "KHR_node_selectability",
                                                    "KHR_implicit_shapes",
                                                    "CESIUM_primitive_outline"};
  return std::ranges::any_of(kPrefixes, [&](std::string_view prefix) { return extension.starts_with(prefix); }) ||
         std::ranges::find(kNames, extension) != kNames.end();
}

/// The reader knows what these do to positions and faces.
bool is_read(std::string_view extension) {
  return extension == kInstancing || std::ranges::find(kOfStorage, extension) != kOfStorage.end();
}

/// Whether a buffer stands for data that is there in compressed form only.
bool is_fallback(const Json& buffer, const std::string& place) {
  const Json* compression = find_extension(buffer, kMeshopt, place);
  if (compression == nullptr) return false;
  const Json* fallback = find_member(*compression, "fallback", place);
  return fallback != nullptr && *fallback == true;
}

std::size_t components_of(const Json& accessor, const std::string& place) {
  constexpr std::array<const char*, 4> kTypes{"SCALAR", "VEC2", "VEC3", "VEC4"};
  const Json* type = find_member(accessor, "type", place);
  const auto names = [&](const char* name) { return type != nullptr && *type == name; };
  const auto found = std::ranges::find_if(kTypes, names);
  if (found != kTypes.end()) return static_cast<std::size_t>(found - kTypes.begin()) + 1;
  throw Error(code::kMeshSyntax, "the type must be SCALAR, VEC2, VEC3 or VEC4", place);
}

}  // namespace

const Json* find_extension(const Json& object, const char* name, const std::string& place) {
  const Json* extensions = find_member(object, "extensions", place);
  return extensions == nullptr ? nullptr : find_member(*extensions, name, place);
}

std::size_t size_of(Component component) {
  switch (component) {
    case Component::kInt8:
    case Component::kUint8:
      return 1;
    case Component::kInt16:
    case Component::kUint16:
      return 2;
    case Component::kUint32:
    case Component::kFloat:
      break;
  }
  return 4;
}

Document::Document(std::string_view bytes, const DecodeLimits& limits) : file_size_(bytes.size()) {
  is_binary_ = bytes.starts_with("glTF");
  if (is_binary_) {
    read_chunks(bytes);
  } else {
    json_text_ = bytes;
    root_ = parse_json(bytes, 0);
  }
  check_versions();
  load_buffers();
  load_draco(limits);
}

void Document::read_chunks(std::string_view bytes) {
  ByteCursor head(bytes);
  head.take(4);
  const auto version = head.read<std::uint32_t>();
  if (version != 2)
    throw Error(code::kMeshUnsupported, fmt::format("GLB version {} is not supported", version), "byte 4");
  const std::size_t length = head.read<std::uint32_t>();
  if (length > bytes.size()) {
    throw Error(code::kMeshTruncated,
                fmt::format("the header announces {} bytes, but the file has {}", length, bytes.size()), "byte 8");
  }
  if (length < head.offset())
    throw Error(code::kMeshSyntax, "the length in the header is too small for a GLB", "byte 8");
  trailing_bytes_ = bytes.size() - length;
  ByteCursor cursor(bytes.substr(0, length), head.offset());
  bool has_json = false;
  while (!has_json || cursor.rest() != 0) {
    const std::string place = cursor.place();
    const std::size_t size = cursor.read<std::uint32_t>();
    const auto type = cursor.read<std::uint32_t>();
    if (!has_json && type != kGlbJson) throw Error(code::kMeshSyntax, "the first chunk is not JSON", place);
    const std::size_t offset = cursor.offset();
    const std::string_view chunk(cursor.take(size), size);
    if (!has_json) {
      json_text_ = chunk.substr(0, chunk.find_last_not_of('\0') + 1);
      root_ = parse_json(json_text_, offset);
      has_json = true;
    } else if (type == kGlbBinary && !binary_chunk_) {
      binary_chunk_ = chunk;
    }
  }
}

void Document::check_versions() const {
  const std::string place = "asset";
  const Json* asset = find_member(root_, "asset", place);
  if (asset == nullptr) throw Error(code::kMeshSyntax, "a glTF file must have a member 'asset'", place);
  const Json* version = find_member(*asset, "version", place);
  if (version == nullptr || !version->is_string()) {
    throw Error(code::kMeshSyntax, "'version' must be a string", place);
  }
  const std::string& number = version->get_ref<const std::string&>();
  if (!number.starts_with("2."))
    throw Error(code::kMeshUnsupported, "glTF version " + printable(number) + " is not supported", place);
  for (const Json& extension : array_member(root_, "extensionsRequired", "extensionsRequired")) {
    if (!extension.is_string())
      throw Error(code::kMeshSyntax, "the name of an extension must be a string", "extensionsRequired");
    const std::string& name = extension.get_ref<const std::string&>();
    if (moves_no_vertex(name) || is_read(name)) continue;
    throw Error(code::kMeshUnsupported,
                "the file requires the extension " + printable(name) + ", which is not supported",
                "extensionsRequired");
  }
}

void Document::load_buffers() {
  const std::size_t count = array_member(root_, "buffers", "buffers").size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::string place = fmt::format("buffer {}", i);
    Json& buffer = root_["buffers"][i];
    const std::size_t length = size_member(buffer, "byteLength", place);
    const std::string_view data = buffer_data(i, buffer, place);
    if (length > data.size() && !is_fallback(buffer, place)) {
      throw Error(code::kMeshCountMismatch,
                  fmt::format("byteLength is {}, but the buffer has {} bytes", length, data.size()), place);
    }
    buffers_.push_back(data.substr(0, length));
  }
}

void Document::load_draco(const DecodeLimits& limits) {
  const Json& meshes = array_member(root_, "meshes", "meshes");
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const std::string place = fmt::format("mesh {}", i);
    for (const Json& primitive : array_member(meshes[i], "primitives", place)) {
      if (find_extension(primitive, kDraco, place) != nullptr) load_primitive(primitive, limits, place);
    }
  }
}

bool Document::has_data(std::size_t accessor, const std::string& place) const {
  return from_draco_.contains(accessor) ||
         find_member(entry("accessors", accessor, place), "bufferView", place) != nullptr;
}

/// Decodes what the accessors of a primitive have no other data for.
void Document::load_primitive(const Json& primitive, const DecodeLimits& limits, const std::string& place) {
  constexpr std::size_t kTriangles = 4;
  if (size_member_or(primitive, "mode", kTriangles, place) != kTriangles) {
    throw Error(code::kMeshUnsupported, "Draco is read for triangles only", place);
  }
  const Json& extension = *find_extension(primitive, kDraco, place);
  const Json* ids = find_member(extension, "attributes", place);
  const Json* attributes = find_member(primitive, "attributes", place);
  if (ids == nullptr || !ids->is_object() || attributes == nullptr || !attributes->is_object()) {
    throw Error(code::kMeshSyntax, "'attributes' is missing", place);
  }
  std::vector<DracoAttribute> wanted;
  std::vector<std::size_t> accessors;
  for (const auto& [name, id] : ids->items()) {
    const std::size_t index = size_member(*attributes, name.c_str(), place);
    if (has_data(index, place)) continue;
    const Json& accessor = entry("accessors", index, place);
    const std::string accessor_place = fmt::format("accessor {}", index);
    wanted.push_back({static_cast<std::uint32_t>(size_value(id, name.c_str(), place)),
                      component_member(accessor, accessor_place), components_of(accessor, accessor_place),
                      size_member(accessor, "count", accessor_place), accessor_place});
    accessors.push_back(index);
  }
  const std::size_t indices = size_member(primitive, "indices", place);
  if (wanted.empty() && has_data(indices, place)) return;
  const std::size_t view_index = size_member(extension, "bufferView", place);
  DracoPrimitive decoded = decode_draco(view(view_index, place), wanted, limits, place);
  for (std::size_t i = 0; i < accessors.size(); ++i) from_draco_[accessors[i]] = std::move(decoded.attributes[i]);
  if (!has_data(indices, place)) store_indices(indices, decoded.indices, place);
}

void Document::store_indices(std::size_t index, const std::vector<std::uint32_t>& indices, const std::string& place) {
  const Json& accessor = entry("accessors", index, place);
  const std::string accessor_place = fmt::format("accessor {}", index);
  const std::size_t size = size_of(component_member(accessor, accessor_place));
  const std::size_t count = size_member(accessor, "count", accessor_place);
  if (count != indices.size() || components_of(accessor, accessor_place) != 1) {
    throw Error(code::kMeshCountMismatch,
                fmt::format("the compressed data has {} corners, but the accessor {}", indices.size(), count),
                accessor_place);
  }
  std::string& bytes = from_draco_[index];
  for (const std::uint32_t corner : indices) {
    if (size < 4 && corner >> (8 * size) != 0) {
      throw Error(code::kMeshIndexOutOfRange, fmt::format("vertex {} does not fit into {} bytes", corner, size),
                  accessor_place);
    }
    for (std::size_t k = 0; k < size; ++k) bytes += static_cast<char>(corner >> (8 * k) & 0xffU);
  }
}

std::string_view Document::buffer_data(std::size_t index, Json& buffer, const std::string& place) {
  const Json* uri = find_member(buffer, "uri", place);
  if (uri == nullptr) {
    if (index == 0 && binary_chunk_) return *binary_chunk_;
    if (is_fallback(buffer, place)) return {};
    throw Error(code::kMeshUnsupported, "the buffer has no data", place);
  }
  if (!uri->is_string()) throw Error(code::kMeshSyntax, "'uri' must be a string", place);
  const std::string_view text = uri->get_ref<const std::string&>();
  if (!text.starts_with("data:")) {
    throw Error(code::kMeshUnsupported, "buffers must be in the file, as a data URI, unlike '" + printable(text) + "'",
                place);
  }
  std::optional<std::string> data = decode_data_uri(text);
  if (!data) throw Error(code::kMeshSyntax, "the data URI is neither valid base64 nor in percent encoding", place);
  buffer.erase("uri");  // the text is no longer needed
  return decoded_.emplace_back(std::move(*data));
}

const Json& Document::entry(const char* array, std::size_t index, const std::string& place) const {
  const Json& entries = array_member(root_, array, array);
  if (index >= entries.size()) {
    throw Error(code::kMeshIndexOutOfRange,
                fmt::format("{}[{}] does not exist: there are {}", array, index, entries.size()), place);
  }
  return entries[index];
}

Accessor Document::accessor(std::size_t index, const std::string& place) const {
  const Json& object = entry("accessors", index, place);
  Accessor accessor;
  accessor.place = fmt::format("accessor {}", index);
  accessor.components = components_of(object, accessor.place);
  const std::size_t count = size_member(object, "count", accessor.place);
  const Component component = component_member(object, accessor.place);
  if (find_member(object, "bufferView", accessor.place) != nullptr) {
    accessor.elements = elements(object, count, component, accessor.components, accessor.place);
  } else if (const auto decoded = from_draco_.find(index); decoded != from_draco_.end()) {
    accessor.elements = {decoded->second.data(), size_of(component) * accessor.components, count, component};
  } else if (count > file_size_) {
    throw Error(
        code::kMeshCountMismatch,
        fmt::format("an accessor without data has {} elements, more than the file has bytes ({})", count, file_size_),
        accessor.place);
  } else {
    accessor.elements = {nullptr, 0, count, component};
  }
  const Json* normalized = find_member(object, "normalized", accessor.place);
  accessor.normalized = normalized != nullptr && *normalized == true;
  const Json* sparse = find_member(object, "sparse", accessor.place);
  if (sparse != nullptr) read_sparse(*sparse, accessor);
  return accessor;
}

std::string_view Document::view(std::size_t index, const std::string& place) const {
  return view_data(index, entry("bufferViews", index, place), fmt::format("bufferView {}", index));
}

std::string_view Document::bytes_in_buffer(const Json& view, const std::string& place) const {
  const std::size_t buffer_index = size_member(view, "buffer", place);
  if (buffer_index >= buffers_.size()) {
    throw Error(code::kMeshIndexOutOfRange,
                fmt::format("buffers[{}] does not exist: there are {}", buffer_index, buffers_.size()), place);
  }
  const std::string_view buffer = buffers_[buffer_index];
  const std::size_t offset = size_member_or(view, "byteOffset", 0, place);
  const std::size_t length = size_member(view, "byteLength", place);
  if (offset > buffer.size() || length > buffer.size() - offset) {
    throw Error(
        code::kMeshCountMismatch,
        fmt::format("{} bytes from byte {} on do not fit into a buffer of {} bytes", length, offset, buffer.size()),
        place);
  }
  return buffer.substr(offset, length);
}

std::string_view Document::view_data(std::size_t index, const Json& view, const std::string& place) const {
  const Json* compression = find_extension(view, kMeshopt, place);
  if (compression == nullptr) return bytes_in_buffer(view, place);
  const auto [known, is_new] = decompressed_.try_emplace(index);
  if (is_new) {
    known->second = decode_meshopt(*compression, bytes_in_buffer(*compression, place),
                                   size_member(view, "byteLength", place), place);
  }
  return known->second;
}

Elements Document::elements(const Json& object, std::size_t count, Component component, std::size_t components,
                            const std::string& place) const {
  const std::size_t view_index = size_member(object, "bufferView", place);
  const Json& view = entry("bufferViews", view_index, place);
  const std::string view_place = fmt::format("bufferView {}", view_index);
  const std::string_view data = view_data(view_index, view, view_place);
  const std::size_t element_size = size_of(component) * components;
  const std::size_t stride = size_member_or(view, "byteStride", element_size, view_place);
  if (stride < element_size) throw Error(code::kMeshSyntax, "'byteStride' is smaller than an element", view_place);
  const std::size_t offset = size_member_or(object, "byteOffset", 0, place);
  const bool fits = count == 0 || (offset <= data.size() && data.size() - offset >= element_size &&
                                   count - 1 <= (data.size() - offset - element_size) / stride);
  if (!fits) {
    throw Error(code::kMeshCountMismatch,
                fmt::format("{} elements from byte {} on do not fit into a buffer view of {} bytes", count, offset,
                            data.size()),
                place);
  }
  return {data.data() + offset, stride, count, component};
}

void Document::read_sparse(const Json& sparse, Accessor& accessor) const {
  const std::string place = accessor.place + ", sparse";
  const std::size_t count = size_member(sparse, "count", place);
  if (count > accessor.count()) {
    throw Error(code::kMeshCountMismatch,
                fmt::format("{} elements are replaced, but there are only {}", count, accessor.count()), place);
  }
  const Json* indices = find_member(sparse, "indices", place);
  const Json* values = find_member(sparse, "values", place);
  if (indices == nullptr || values == nullptr) {
    throw Error(code::kMeshSyntax, "'indices' or 'values' is missing", place);
  }
  accessor.sparse_indices = elements(*indices, count, component_member(*indices, place), 1, place);
  accessor.sparse_values = elements(*values, count, accessor.elements.component, accessor.components, place);
}

double load_number(const char* at, const Accessor& accessor) {
  const auto scaled = [&](auto value) {
    constexpr auto kLargest = static_cast<double>(std::numeric_limits<decltype(value)>::max());
    return accessor.normalized ? std::max(static_cast<double>(value) / kLargest, -1.0) : static_cast<double>(value);
  };
  switch (accessor.elements.component) {
    case Component::kInt8:
      return scaled(load<std::int8_t>(at, false));
    case Component::kUint8:
      return scaled(load<std::uint8_t>(at, false));
    case Component::kInt16:
      return scaled(load<std::int16_t>(at, false));
    case Component::kUint16:
      return scaled(load<std::uint16_t>(at, false));
    case Component::kUint32:
      return scaled(load<std::uint32_t>(at, false));
    case Component::kFloat:
      break;
  }
  return static_cast<double>(load<float>(at, false));
}

Eigen::Vector3d load_vector(const char* at, const Accessor& accessor) {
  if (accessor.elements.component == Component::kFloat) {
    return {load<float>(at, false), load<float>(at + 4, false), load<float>(at + 8, false)};
  }
  const std::size_t size = size_of(accessor.elements.component);
  return {load_number(at, accessor), load_number(at + size, accessor), load_number(at + 2 * size, accessor)};
}

std::uint32_t load_unsigned(const char* at, Component component, const std::string& place) {
  switch (component) {
    case Component::kUint8:
      return load<std::uint8_t>(at, false);
    case Component::kUint16:
      return load<std::uint16_t>(at, false);
    case Component::kUint32:
      return load<std::uint32_t>(at, false);
    case Component::kInt8:
    case Component::kInt16:
    case Component::kFloat:
      break;
  }
  throw Error(code::kMeshSyntax, "the component type must be an unsigned integer type", place);
}

}  // namespace crease::gltf
