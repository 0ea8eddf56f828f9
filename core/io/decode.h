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
  /// Of the likelihood, one per vertex, where the file has them: PLY's vertex property `weight` or glTF's attribute
  /// `_WEIGHT` (1 for primitives without it). Empty: it has none.
  std::vector<double> weights;
  /// polygons_triangulated, vertices_welded, stl_vertices_welded, source_ignored, trailing_bytes, elements_skipped,
  /// statements_skipped, primitives_skipped; each at most once per cause, with counts.
  std::vector<Warning> warnings;
};

/// Reads OBJ, PLY (ASCII, both binaries), OFF, STL (both), glTF (embedded buffers only) or GLB from untrusted bytes.
/// Without a format it is guessed from the bytes. Vertices and faces keep their order and winding; polygons become
/// fans; STL corners are welded by exact position, and so are glTF vertices that coincide, unless the attribute _SOURCE
/// names the originals of copies: those are folded back. Of vertices that become one, the first gives the weight. JSON
/// is written only. \throw Error mesh_*, weights_invalid with the place of the first fault: "line 12" (from 1), "byte
/// 84", "face 3" (from 0, as the file counts its polygons) or the glTF entry, "accessor 2"
DecodedMesh decode_mesh(std::string_view bytes, std::optional<MeshFormat> format, const DecodeLimits& limits = {});

}  // namespace crease
