#pragma once

#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/io/mesh_format.h"
#include "core/mesh/mesh.h"

namespace crease {

/// Bounds that hold before memory is reserved for what a header promises.
struct DecodeLimits {
  std::size_t max_vertices = 20'000'000;
  std::size_t max_faces = 20'000'000;
};

struct DecodedMesh {
  Mesh mesh;
  MeshFormat format = MeshFormat::kObj;
  std::vector<Warning> warnings;  ///< polygons triangulated, vertices welded, unknown statements skipped
};

/// Reads OBJ, PLY (ASCII, both binaries), OFF, STL (both), glTF (embedded buffers only) or GLB from untrusted bytes.
/// Without a format it is guessed from the bytes. Vertices and faces keep their order and winding; polygons become
/// fans; STL corners are welded by exact position.
/// \throw Error mesh_* with the place of the first fault
DecodedMesh decode_mesh(std::string_view bytes, std::optional<MeshFormat> format, const DecodeLimits& limits = {});

}  // namespace crease
