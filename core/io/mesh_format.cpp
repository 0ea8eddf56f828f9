#include "core/io/mesh_format.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string>

#include "core/base/text.h"

namespace crease {
namespace {

struct FormatNames {
  MeshFormat format;
  std::string_view name;
  std::string_view media_type;
};

constexpr std::array<FormatNames, 7> kFormats{{
    {MeshFormat::kObj, "obj", "model/obj"},
    {MeshFormat::kPly, "ply", "application/x-ply"},
    {MeshFormat::kOff, "off", "application/x-off"},
    {MeshFormat::kStl, "stl", "model/stl"},
    {MeshFormat::kGltf, "gltf", "model/gltf+json"},
    {MeshFormat::kGlb, "glb", "model/gltf-binary"},
    {MeshFormat::kJson, "json", "application/json"},
}};

struct MediaTypeAlias {
  std::string_view media_type;
  MeshFormat format;
};

constexpr std::array<MediaTypeAlias, 12> kAliases{{
    {"text/x-obj", MeshFormat::kObj},
    {"application/x-tgif", MeshFormat::kObj},
    {"model/ply", MeshFormat::kPly},
    {"text/x-ply", MeshFormat::kPly},
    {"model/off", MeshFormat::kOff},
    {"text/x-off", MeshFormat::kOff},
    {"application/sla", MeshFormat::kStl},
    {"application/vnd.ms-pki.stl", MeshFormat::kStl},
    {"application/x-stl", MeshFormat::kStl},
    {"model/x.stl-ascii", MeshFormat::kStl},
    {"model/x.stl-binary", MeshFormat::kStl},
    {"model/gltf", MeshFormat::kGltf},
}};

constexpr std::size_t kStlHeader = 84;
constexpr std::size_t kStlFacet = 50;

const FormatNames& names_of(MeshFormat format) {
  return *std::find_if(kFormats.begin(), kFormats.end(), [&](const FormatNames& row) { return row.format == format; });
}

std::uint64_t stl_size(std::string_view bytes) {
  std::uint64_t facets = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    facets |= std::uint64_t{static_cast<unsigned char>(bytes[kStlHeader - 4 + i])} << (8 * i);
  }
  return facets == 0 ? 0 : kStlHeader + kStlFacet * facets;
}

bool is_exactly_binary_stl(std::string_view bytes) {
  return bytes.size() > kStlHeader && stl_size(bytes) == bytes.size();
}

bool looks_like_binary_stl(std::string_view bytes) {
  if (bytes.size() <= kStlHeader || bytes.substr(0, kStlHeader).find('\0') == std::string_view::npos) return false;
  const std::uint64_t size = stl_size(bytes);
  return size != 0 && size <= bytes.size();
}

bool is_off_keyword(std::string_view word) {
  constexpr std::string_view kOff = "OFF";
  return word.size() >= kOff.size() && word.ends_with(kOff) &&
         word.substr(0, word.size() - kOff.size()).find_first_not_of("STCN4n") == std::string_view::npos;
}

bool is_obj_keyword(std::string_view word) {
  constexpr std::array<std::string_view, 13> kKeywords{"v", "vt", "vn", "vp", "f",      "o",     "g",
                                                       "s", "l",  "p",  "mg", "mtllib", "usemtl"};
  return std::find(kKeywords.begin(), kKeywords.end(), word) != kKeywords.end();
}

std::string_view first_word_after_comments(std::string_view text) {
  for (;;) {
    const std::size_t start = text.find_first_not_of(" \t\r\n");
    if (start == std::string_view::npos) return {};
    text.remove_prefix(start);
    if (text.front() != '#') return text.substr(0, text.find_first_of(" \t\r\n"));
    const std::size_t end = text.find_first_of("\r\n");
    if (end == std::string_view::npos) return {};
    text.remove_prefix(end);
  }
}

}  // namespace

std::string_view format_name(MeshFormat format) { return names_of(format).name; }

std::string_view media_type(MeshFormat format) { return names_of(format).media_type; }

std::optional<MeshFormat> format_from_name(std::string_view name) {
  for (const FormatNames& row : kFormats) {
    if (row.name == name) return row.format;
  }
  return std::nullopt;
}

std::optional<MeshFormat> format_from_filename(std::string_view filename) {
  const std::string_view last = filename.substr(filename.find_last_of("/\\") + 1);
  const std::size_t dot = last.rfind('.');
  if (dot == std::string_view::npos) return std::nullopt;
  return format_from_name(lower(last.substr(dot + 1)));
}

std::optional<MeshFormat> format_from_media_type(std::string_view media_type) {
  const std::string wanted = lower(trimmed(media_type.substr(0, media_type.find(';'))));
  for (const FormatNames& row : kFormats) {
    if (row.media_type == wanted) return row.format;
  }
  for (const MediaTypeAlias& row : kAliases) {
    if (row.media_type == wanted) return row.format;
  }
  return std::nullopt;
}

std::optional<MeshFormat> sniff_format(std::string_view bytes) {
  if (bytes.starts_with("glTF")) return MeshFormat::kGlb;
  if (is_exactly_binary_stl(bytes)) return MeshFormat::kStl;
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  if (bytes.starts_with(kByteOrderMark)) bytes.remove_prefix(kByteOrderMark.size());
  const std::string_view word = first_word_after_comments(bytes);
  if (word == "ply" && bytes.starts_with("ply")) return MeshFormat::kPly;
  if (lower(word.substr(0, 5)) == "solid" || looks_like_binary_stl(bytes)) return MeshFormat::kStl;
  if (is_off_keyword(word)) return MeshFormat::kOff;
  if (word.starts_with('{')) {
    return bytes.find("\"asset\"") != std::string_view::npos ? MeshFormat::kGltf : MeshFormat::kJson;
  }
  if (is_obj_keyword(word)) return MeshFormat::kObj;
  return std::nullopt;
}

}  // namespace crease
