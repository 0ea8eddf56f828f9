#include "core/io/gltf_looks.h"

#include <algorithm>
#include <optional>

#include "core/base/text.h"
#include "core/io/base64.h"
#include "core/io/gltf_builder.h"

namespace crease {
namespace {

using gltf::Accessor;
using gltf::Json;

constexpr std::array<const char*, 3> kTextureArrays{"textures", "samplers", "images"};
constexpr const char* kColours = "COLOR_0";

std::string texture_name(std::size_t set) { return fmt::format("TEXCOORD_{}", set); }

std::size_t texture_sets(const Json& attributes) {
  constexpr std::size_t kMostSets = 8;  // more than viewers use, and what a small file may ask memory for
  std::size_t sets = 0;
  while (sets < kMostSets && attributes.contains(texture_name(sets))) ++sets;
  return sets;
}

/// The names of the extensions that a value has somewhere. The depth of the JSON is limited.
void find_extensions(const Json& value, std::set<std::string>& names) {
  for (const auto& [name, member] : value.items()) {
    if (name == "extensions" && member.is_object()) {
      for (const auto& [extension, content] : member.items()) names.insert(extension);
    }
    if (member.is_structured()) find_extensions(member, names);
  }
}

/// A picture in a data URI.
struct Embedded {
  std::string media_type, bytes;
};

/// The picture in the URI of an image, or nothing.
std::optional<Embedded> embedded_in(const Json& image) {
  constexpr std::string_view kData = "data:";
  const auto uri = image.find("uri");
  if (uri == image.end() || !uri->is_string()) return std::nullopt;
  const std::string_view text = uri->get_ref<const std::string&>();
  std::optional<std::string> bytes = decode_data_uri(text);
  if (!bytes) return std::nullopt;
  const std::string_view media_type = text.substr(kData.size(), text.find_first_of(";,") - kData.size());
  return Embedded{std::string(media_type), std::move(*bytes)};
}

/// Those of the names in an array that a part of a file mentions.
std::vector<std::string> mentioned(const Json& array, const std::set<std::string>& names) {
  std::vector<std::string> found;
  for (const Json& name : array) {
    if (name.is_string() && names.contains(name.get<std::string>())) found.push_back(name.get<std::string>());
  }
  return found;
}

}  // namespace

bool GltfLooks::is_read(std::string_view name, const Json& attributes) {
  if (name == kColours) return true;
  for (std::size_t set = 0; set < texture_sets(attributes); ++set) {
    if (name == texture_name(set)) return true;
  }
  return false;
}

std::vector<std::size_t> GltfLooks::accessors(const Json& attributes, const std::string& place) {
  std::vector<std::size_t> found{gltf::size_member_or(attributes, kColours, kNone, place)};
  for (std::size_t set = 0; set < texture_sets(attributes); ++set) {
    found.push_back(gltf::size_member(attributes, texture_name(set).c_str(), place));
  }
  return found;
}

void GltfLooks::read(const Json& attributes, const VertexRange& range, const std::string& place) {
  if (attributes.contains(kColours)) read_colours(gltf::size_member(attributes, kColours, place), range, place);
  for (std::size_t set = 0; set < texture_sets(attributes); ++set) {
    read_texture(gltf::size_member(attributes, texture_name(set).c_str(), place), set, range, place);
  }
}

Accessor GltfLooks::checked(std::size_t index, std::size_t least, std::size_t most, const VertexRange& range,
                            const std::string& place) const {
  Accessor accessor = document_.accessor(index, place);
  if (accessor.components < least || accessor.components > most) {
    throw Error(code::kMeshSyntax, "colours must be VEC3 or VEC4, and texture coordinates VEC2", accessor.place);
  }
  if (accessor.count() != range.count) {
    throw Error(code::kMeshCountMismatch,
                fmt::format("there are {} elements for {} vertices", accessor.count(), range.count), accessor.place);
  }
  return accessor;
}

void GltfLooks::read_colours(std::size_t index, const VertexRange& range, const std::string& place) {
  const Accessor accessor = checked(index, 3, 4, range, place);
  std::vector<Colour>& colours = builder_.appearance().colours.values;
  colours.resize(range.first + range.count, Colour{1, 1, 1, 1});
  bool fits = true;
  gltf::for_each_element(accessor, [&](std::size_t element, const char* bytes) {
    for (std::size_t k = 0; k < accessor.components; ++k) {
      const double value = gltf::load_number(bytes + k * size_of(accessor.elements.component), accessor);
      const bool is_part = value >= 0 && value <= 1;
      fits = fits && is_part;
      colours[range.first + element][k] = is_part ? static_cast<float>(value) : 1;
    }
  });
  if (!fits) builder_.drop("colours that are not from 0 to 1");
}

void GltfLooks::read_texture(std::size_t index, std::size_t set, const VertexRange& range, const std::string& place) {
  const Accessor accessor = checked(index, 2, 2, range, place);
  std::vector<CornerValues<2>>& texture = builder_.appearance().texture;
  if (texture.size() <= set) texture.resize(set + 1);
  std::vector<std::array<float, 2>>& values = texture[set].values;
  values.resize(range.first + range.count, {0, 0});
  gltf::for_each_element(accessor, [&](std::size_t element, const char* bytes) {
    const std::size_t size = size_of(accessor.elements.component);
    values[range.first + element] = {static_cast<float>(gltf::load_number(bytes, accessor)),
                                     static_cast<float>(gltf::load_number(bytes + size, accessor))};
  });
}

void GltfLooks::finish() {
  Appearance& look = builder_.appearance();
  look.as_gltf = true;
  const std::vector<Triangle>& triangles = builder_.mesh().triangles;
  if (!look.colours.empty()) {
    look.colours.values.resize(builder_.vertices(), Colour{1, 1, 1, 1});
    look.colours.corners = triangles;
  }
  for (CornerValues<2>& set : look.texture) {
    set.values.resize(builder_.vertices(), {0, 0});
    set.corners = triangles;
  }
}

void GltfMaterials::start(const Json& primitive, const std::string& place) {
  const bool has_material = gltf::find_member(primitive, "material", place) != nullptr;
  builder_.start_material(has_material ? number_of(gltf::size_member(primitive, "material", place), place) : kNone);
}

Index GltfMaterials::number_of(std::size_t index, const std::string& place) {
  const auto [known, is_new] = numbers_.try_emplace(index, kNone);
  if (!is_new) return known->second;
  const Json& material = document_.entry("materials", index, place);
  if (!material.is_object()) throw Error(code::kMeshSyntax, "a material must be an object", place);
  if (is_own_material(material)) return kNone;
  std::vector<Material>& materials = builder_.appearance().materials;
  known->second = static_cast<Index>(materials.size());
  const Json* name = gltf::find_member(material, "name", place);
  materials.push_back({name != nullptr && name->is_string() ? name->get<std::string>() : "", material.dump()});
  return known->second;
}

void GltfMaterials::finish() {
  std::set<std::string> extensions;
  bool have_textures = false;
  for (const Material& material : builder_.appearance().materials) {
    find_extensions(Json::parse(material.json), extensions);
    have_textures = have_textures || material.json.find("Texture\":") != std::string::npos;
  }
  if (have_textures) {
    read_textures();
    for (const char* array : kTextureArrays) {
      find_extensions(gltf::array_member(document_.root(), array, array), extensions);
    }
  }
  GltfParts& parts = builder_.appearance().gltf;
  const Json& root = document_.root();
  parts.extensions_used = mentioned(gltf::array_member(root, "extensionsUsed", "extensionsUsed"), extensions);
  parts.extensions_required =
      mentioned(gltf::array_member(root, "extensionsRequired", "extensionsRequired"), extensions);
  note_extensions();
}

void GltfMaterials::read_textures() {
  GltfParts& parts = builder_.appearance().gltf;
  Json arrays = Json::object();
  for (const char* array : {"textures", "samplers"}) {
    const Json& entries = gltf::array_member(document_.root(), array, array);
    if (!entries.empty()) arrays[array] = entries;
  }
  const Json& images = gltf::array_member(document_.root(), "images", "images");
  for (std::size_t i = 0; i < images.size(); ++i) {
    arrays["images"].push_back(read_image(images[i], fmt::format("image {}", i)));
  }
  if (!arrays.empty()) parts.textures = arrays.dump();
}

/// The image with its picture among those that were read, where the file has it. Several images may be in one view.
Json GltfMaterials::read_image(const Json& image, const std::string& place) {
  std::vector<std::string>& images = builder_.appearance().gltf.images;
  if (gltf::find_member(image, "bufferView", place) != nullptr) {
    const std::size_t view = gltf::size_member(image, "bufferView", place);
    const auto [known, is_new] = image_views_.try_emplace(view, images.size());
    if (is_new) images.emplace_back(document_.view(view, place));
    Json read = image;
    read["bufferView"] = known->second;
    return read;
  }
  std::optional<Embedded> embedded = embedded_in(image);
  if (!embedded) return image;
  Json read = Json::object();
  for (const auto& [name, member] : image.items()) {
    if (name != "uri") read[name] = member;
  }
  read["mimeType"] = embedded->media_type;
  read["bufferView"] = images.size();
  images.push_back(std::move(embedded->bytes));
  return read;
}

/// Notes the extensions that belong to no material, no texture, and not to the way in which the file is stored.
void GltfMaterials::note_extensions() const {
  const Json& root = document_.root();
  std::set<std::string> known(gltf::kOfStorage.begin(), gltf::kOfStorage.end());
  known.insert(gltf::kInstancing);
  for (const char* array : {"materials", "textures", "samplers", "images"}) {
    find_extensions(gltf::array_member(root, array, array), known);
  }
  for (const Json& name : gltf::array_member(root, "extensionsUsed", "extensionsUsed")) {
    if (name.is_string() && !known.contains(name.get<std::string>())) {
      builder_.drop("extension " + printable(name.get<std::string>()));
    }
  }
}

}  // namespace crease
