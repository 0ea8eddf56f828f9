#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/csv.h"
#include "core/io/format.h"
#include "core/io/gltf.h"
#include "core/io/json.h"
#include "core/io/obj.h"
#include "core/io/off.h"
#include "core/io/ply.h"
#include "core/io/stl.h"

namespace crease {

/// The formats of meshes, in the order of their rows in kFormats.
enum class MeshFormat : std::uint8_t { kGlb, kGltf, kObj, kPly, kStl, kOff, kJson };

/// Every format that core reads or writes, the preferred ones first: the rows of MeshFormat, then those that hold no
/// mesh. Sniffing, media types, `format=` values, file extensions and help texts all come from here.
inline constexpr std::array kFormats = std::to_array<Format>({
    {.name = "glb",
     .title = "GLB",
     .media_types = {"model/gltf-binary"},
     .extensions = {"glb"},
     .has_compression = true,
     .keeps = {kVertexColours, kOpacity, kCornerColours, kTextureCoordinates, kFurtherTexture, kMaterialNames,
               kMaterials, kTextures},
     .looks_like = looks_like_glb,
     .read = read_gltf,
     .write = write_glb,
     .patch = patch_gltf,
     .write_ridges = write_ridges_glb},
    {.name = "gltf",
     .title = "glTF",
     .media_types = {"model/gltf+json", "model/gltf"},
     .extensions = {"gltf"},
     .is_text = true,
     .has_compression = true,
     .keeps = {kVertexColours, kOpacity, kCornerColours, kTextureCoordinates, kFurtherTexture, kMaterialNames,
               kMaterials, kTextures},
     .looks_like = looks_like_gltf,
     .read = read_gltf,
     .write = write_gltf,
     .patch = patch_gltf},
    {.name = "obj",
     .title = "OBJ",
     .media_types = {"model/obj", "text/x-obj", "application/x-tgif"},
     .extensions = {"obj"},
     .is_text = true,
     .has_ridge_lines = true,
     .keeps = {kVertexColours, kTextureCoordinates, kMaterialNames, kMaterialLibraries},
     .looks_like = looks_like_obj,
     .read = read_obj,
     .write = write_obj,
     .patch = patch_obj},
    {.name = "ply",
     .title = "PLY",
     .media_types = {"application/x-ply", "model/ply", "text/x-ply"},
     .extensions = {"ply"},
     .keeps = {kVertexColours, kOpacity, kFaceColours, kTextureCoordinates},
     .looks_like = looks_like_ply,
     .read = read_ply,
     .write = write_ply,
     .patch = patch_ply},
    {.name = "stl",
     .title = "STL",
     .media_types = {"model/stl", "application/sla", "application/vnd.ms-pki.stl", "application/x-stl",
                     "model/x.stl-ascii", "model/x.stl-binary"},
     .extensions = {"stl"},
     .has_free_head = true,
     .looks_like = looks_like_stl,
     .read = read_stl,
     .write = write_stl,
     .patch = patch_stl},
    {.name = "off",
     .title = "OFF",
     .media_types = {"application/x-off", "model/off", "text/x-off"},
     .extensions = {"off"},
     .is_text = true,
     .keeps = {kVertexColours, kOpacity, kFaceColours},
     .looks_like = looks_like_off,
     .read = read_off,
     .write = write_off,
     .patch = patch_off},
    {.name = "json",
     .title = "JSON",
     .media_types = {"application/json"},
     .extensions = {"json"},
     .is_text = true,
     .looks_like = looks_like_json,
     .write = write_json,
     .write_labels = write_labels_json,
     .write_ridges = write_ridges_json},
    {.name = "csv",
     .title = "CSV",
     .media_types = {"text/csv"},
     .extensions = {"csv"},
     .is_text = true,
     .write_labels = write_labels_csv},
});

constexpr bool holds_mesh(const Format& format) { return format.read != nullptr || format.write != nullptr; }

/// Every MeshFormat, in order.
inline constexpr auto kMeshFormats = [] {
  constexpr std::ptrdiff_t kCount = std::count_if(kFormats.begin(), kFormats.end(), holds_mesh);
  std::array<MeshFormat, kCount> formats{};
  for (std::size_t i = 0; i < formats.size(); ++i) formats[i] = static_cast<MeshFormat>(i);
  return formats;
}();

constexpr const Format& format_row(MeshFormat format) { return kFormats.at(static_cast<std::size_t>(format)); }
constexpr std::string_view format_name(MeshFormat format) { return format_row(format).name; }
/// The media type that the format is served under.
constexpr std::string_view media_type(MeshFormat format) { return format_row(format).media_types.front(); }

/// Rows of the table, or of a table in another room that extends it.
using Formats = std::vector<const Format*>;

/// The formats that support an operation, such as `formats_with(&Format::read)`.
template <typename Function>
Formats formats_with(Function* Format::*function) {
  Formats found;
  for (const Format& format : kFormats) {
    if (format.*function != nullptr) found.push_back(&format);
  }
  return found;
}

/// The formats that have a property, such as `formats_that(&Format::has_compression)`.
inline Formats formats_that(bool Format::*have) {
  Formats found;
  for (const Format& format : kFormats) {
    if (format.*have) found.push_back(&format);
  }
  return found;
}

/// The formats of `formats` that are text before those that are not.
Formats text_first(Formats formats);

/// The format called exactly `name`, or null.
const Format* find_by_name(const Formats& formats, std::string_view name);
/// The format of a file by its extension in any case, or null. Only the last component of a path counts.
const Format* find_by_filename(const Formats& formats, std::string_view filename);
/// The format of a media type in any case, or null. Parameters of the media type are ignored.
const Format* find_by_media_type(const Formats& formats, std::string_view media_type);

/// The names as a list in a sentence: "obj, ply or stl".
std::string name_list(const Formats& formats, std::string_view conjunction = "or");
/// The same with the titles: "OBJ, PLY or STL".
std::string title_list(const Formats& formats, std::string_view conjunction = "or");

/// As above, among the formats of meshes.
std::optional<MeshFormat> format_from_name(std::string_view name);
std::optional<MeshFormat> format_from_filename(std::string_view filename);
std::optional<MeshFormat> format_from_media_type(std::string_view media_type);

/// The format that the bytes resemble most; if several do, the first of them in the table.
std::optional<MeshFormat> sniff_format(std::string_view bytes);

}  // namespace crease
