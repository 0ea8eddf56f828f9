#include "core/io/decode.h"

#include <fmt/format.h>

namespace crease {
namespace {

/// The format to read: the declared one, unless the bytes say which variant of it they are.
MeshFormat settle_format(std::optional<MeshFormat> declared, std::optional<MeshFormat> seen) {
  if (!declared && !seen) {
    throw Error(code::kMeshFormatUnknown,
                fmt::format("the bytes look like none of {}", title_list(formats_with(&Format::read), "and")),
                "byte 0");
  }
  if (!declared || !seen) return declared ? *declared : *seen;
  const Format &wanted = format_row(*declared), &found = format_row(*seen);
  if (wanted.read != nullptr && wanted.read == found.read) return *seen;
  if (*declared == *seen || wanted.has_free_head) return *declared;
  throw Error(code::kMeshSyntax, fmt::format("declared as {}, but the bytes look like {}", wanted.name, found.name),
              "byte 0");
}

}  // namespace

DecodedMesh decode_mesh(std::string_view bytes, std::optional<MeshFormat> format, const DecodeLimits& limits) {
  if (bytes.find_first_not_of(" \t\r\n") == std::string_view::npos) {
    throw Error(code::kMeshEmpty, "the file is empty", "byte 0");
  }
  const MeshFormat settled = settle_format(format, sniff_format(bytes));
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
