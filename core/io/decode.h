#pragma once

#include <optional>
#include <string_view>

#include "core/io/format.h"
#include "core/io/formats.h"

namespace crease {

/// The content of a mesh file and its format.
struct DecodedMesh : MeshContent {
  MeshFormat format = MeshFormat::kObj;
};

/// Reads a mesh from untrusted bytes in any format of the table that can be read. Without a format, the bytes decide.
/// Vertices and faces keep their order and winding; polygons become fans. STL corners and glTF vertices at exactly the
/// same position become one vertex, see read_stl and read_gltf.
/// \throw Error mesh_*, weights_invalid. The place is that of the first fault: "line 12" (from 1), "byte 84", "face 3"
///        (from 0, as the file counts its polygons) or the glTF entry, such as "accessor 2"
DecodedMesh decode_mesh(std::string_view bytes, std::optional<MeshFormat> format, const DecodeLimits& limits = {});

}  // namespace crease
