#pragma once

#include <optional>
#include <string_view>

namespace crease {

enum class MeshFormat { kObj, kPly, kOff, kStl, kGltf, kGlb, kJson };

/// "obj", "ply", "off", "stl", "gltf", "glb", "json".
std::string_view format_name(MeshFormat format);
/// The media type that the format is served under.
std::string_view media_type(MeshFormat format);

std::optional<MeshFormat> format_from_name(std::string_view name);
/// By extension, in any case; only the last component of a path counts.
std::optional<MeshFormat> format_from_filename(std::string_view filename);
/// Media type without parameters, in any case; empty for application/octet-stream and unknown types.
std::optional<MeshFormat> format_from_media_type(std::string_view media_type);
/// From the first bytes: magic numbers, then the look of the text.
std::optional<MeshFormat> sniff_format(std::string_view bytes);

}  // namespace crease
