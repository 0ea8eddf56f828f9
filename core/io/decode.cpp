#include "core/io/decode.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/base/text.h"

namespace crease {
namespace {

bool has_binary_start(std::string_view bytes) {
  constexpr std::size_t kStart = 84;
  return bytes.substr(0, kStart).find('\0') != std::string_view::npos;
}

/// "UTF-16" or "UTF-32" if the bytes are text in such an encoding, otherwise empty. Without a byte order mark, plain
/// text in UTF-16 has a NUL in every other byte.
std::string_view wide_encoding(std::string_view bytes) {
  using std::string_view_literals::operator""sv;
  if (bytes.starts_with("\xff\xfe\0\0"sv) || bytes.starts_with("\0\0\xfe\xff"sv)) return "UTF-32";
  if (bytes.starts_with("\xff\xfe") || bytes.starts_with("\xfe\xff")) return "UTF-16";
  constexpr std::size_t kLeast = 8, kMost = 64;
  if (bytes.size() < kLeast) return {};
  const std::string_view start = bytes.substr(0, std::min(bytes.size(), kMost) / 2 * 2);
  for (const std::size_t first : {0U, 1U}) {
    bool fits = true;
    for (std::size_t i = 0; i < start.size(); ++i) {
      const auto byte = static_cast<unsigned char>(start[i]);
      const bool is_text = (byte >= ' ' && byte < 0x7f) || (byte >= '\t' && byte <= '\r');
      fits = fits && (i % 2 == first ? byte == 0 : is_text);
    }
    if (fits) return "UTF-16";
  }
  return {};
}

/// What the bytes of files begin with that are no meshes, or meshes in formats that are not read.
struct Foreign {
  std::string_view start, kind;
};
constexpr std::array<Foreign, 13> kForeign{{{"\x89PNG", "a PNG picture"},
                                            {"\xff\xd8\xff", "a JPEG picture"},
                                            {"GIF8", "a GIF picture"},
                                            {"%PDF-", "a PDF document"},
                                            {"PK\x03\x04", "a ZIP archive, as 3MF files are"},
                                            {"\x1f\x8b", "gzip"},
                                            {"7z\xbc\xaf", "a 7z archive"},
                                            {"<!doctype html", "an HTML page"},
                                            {"<html", "an HTML page"},
                                            {"<?xml", "XML, as COLLADA files are"},
                                            {"ISO-10303-21", "STEP"},
                                            {"Kaydara FBX", "FBX"},
                                            {"BLENDER", "a Blender file"}}};

void refuse_foreign(std::string_view bytes) {
  const auto found = std::ranges::find_if(
      kForeign, [&](const Foreign& one) { return equals_ignoring_case(bytes.substr(0, one.start.size()), one.start); });
  if (found == kForeign.end()) return;
  throw Error(
      code::kMeshFormatUnknown,
      fmt::format("the bytes look like {}; expected {}", found->kind, title_list(formats_with(&Format::read), "or")),
      "byte 0");
}

/// The format to read: the declared one, unless the bytes say which variant of it they are.
MeshFormat settle_format(std::string_view bytes, std::optional<MeshFormat> declared, std::optional<MeshFormat> seen) {
  if (!declared && !seen) {
    throw Error(code::kMeshFormatUnknown,
                fmt::format("the bytes look like none of {}", title_list(formats_with(&Format::read), "and")),
                "byte 0");
  }
  if (!declared || !seen) return declared ? *declared : *seen;
  const Format &wanted = format_row(*declared), &found = format_row(*seen);
  if (wanted.read != nullptr && wanted.read == found.read) return *seen;
  if (*declared == *seen || (wanted.has_free_head && has_binary_start(bytes))) return *declared;
  throw Error(code::kMeshSyntax, fmt::format("declared as {}, but the bytes look like {}", wanted.name, found.name),
              "byte 0");
}

}  // namespace

DecodedMesh decode_mesh(std::string_view bytes, std::optional<MeshFormat> format, const DecodeLimits& limits) {
  if (bytes.find_first_not_of(" \t\r\n") == std::string_view::npos) {
    throw Error(code::kMeshEmpty, "the file is empty", "byte 0");
  }
  const std::optional<MeshFormat> seen = sniff_format(bytes);
  const std::string_view encoding = wide_encoding(bytes);
  // In UTF-32 a letter looks like the count of facets in a binary STL file.
  if (!encoding.empty() && (!seen || encoding == "UTF-32")) {
    throw Error(code::kMeshSyntax, fmt::format("the text is encoded in {}; expected UTF-8", encoding), "byte 0");
  }
  if (!seen) refuse_foreign(bytes);
  const MeshFormat settled = settle_format(bytes, format, seen);
  const Format& row = format_row(settled);
  if (row.read == nullptr) {
    throw Error(code::kMeshUnsupported, fmt::format("{} meshes can be written but not read", row.title), "byte 0");
  }
  DecodedMesh decoded{row.read(bytes, limits), settled};
  if (decoded.mesh.triangles.empty()) {
    throw Error(code::kMeshNoFaces, fmt::format("the file has {} vertices and no faces", decoded.mesh.positions.size()),
                fmt::format("byte {}", bytes.size()));
  }
  return decoded;
}

}  // namespace crease
