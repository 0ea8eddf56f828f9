#include "core/io/decode.h"

#include <fmt/format.h>

#include "core/io/readers.h"

namespace crease {
namespace {

bool is_gltf(MeshFormat format) { return format == MeshFormat::kGltf || format == MeshFormat::kGlb; }

/// The head of a binary STL is free text, so that nothing can be concluded from its look.
MeshFormat settle_format(std::optional<MeshFormat> declared, std::optional<MeshFormat> seen) {
  if (!declared && !seen) {
    throw Error(code::kMeshFormatUnknown, "the bytes look like none of OBJ, PLY, OFF, STL, glTF and GLB", "byte 0");
  }
  if (!declared || !seen) return declared ? *declared : *seen;
  if (*declared == *seen || *declared == MeshFormat::kStl || (is_gltf(*declared) && is_gltf(*seen))) return *declared;
  throw Error(code::kMeshSyntax,
              fmt::format("declared as {}, but the bytes look like {}", format_name(*declared), format_name(*seen)),
              "byte 0");
}

DecodedMesh read(std::string_view bytes, MeshFormat format, const DecodeLimits& limits) {
  switch (format) {
    case MeshFormat::kObj:
      return read_obj(bytes, limits);
    case MeshFormat::kPly:
      return read_ply(bytes, limits);
    case MeshFormat::kOff:
      return read_off(bytes, limits);
    case MeshFormat::kStl:
      return read_stl(bytes, limits);
    case MeshFormat::kGltf:
    case MeshFormat::kGlb:
      return read_gltf(bytes, limits);
    case MeshFormat::kJson:
      break;
  }
  throw Error(code::kMeshUnsupported, "meshes are written as JSON, but not read from it", "byte 0");
}

}  // namespace

DecodedMesh decode_mesh(std::string_view bytes, std::optional<MeshFormat> format, const DecodeLimits& limits) {
  if (bytes.find_first_not_of(" \t\r\n") == std::string_view::npos) {
    throw Error(code::kMeshEmpty, "the file is empty", "byte 0");
  }
  DecodedMesh decoded = read(bytes, settle_format(format, sniff_format(bytes)), limits);
  if (decoded.mesh.triangles.empty()) {
    throw Error(code::kMeshNoFaces, fmt::format("the file has {} vertices and no faces", decoded.mesh.positions.size()),
                fmt::format("byte {}", bytes.size()));
  }
  return decoded;
}

}  // namespace crease
