#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "core/io/format.h"

namespace crease {

Likeness looks_like_gltf(const Sample& sample);
Likeness looks_like_glb(const Sample& sample);

/// Reads glTF with embedded buffers, or GLB, whichever the bytes are. Vertices at exactly the same position become one,
/// unless the attribute `_SOURCE` names the original of each copy; copies then become their originals again. The first
/// of the vertices that become one gives the weight. \throw Error mesh_*, weights_invalid with the glTF entry, such as
/// "accessor 2"
MeshContent read_gltf(std::string_view bytes, const DecodeLimits& limits);

/// Writes one node with one mesh. `extras` goes into asset.extras.
///
/// Primitive 0, triangles: POSITION, NORMAL (area-weighted, split along ridges, boundaries and edges whose faces are
/// wound differently), `_LABEL` (the largest label of the vertex's edges) and `_SOURCE` (the vertex of the upload). The
/// vertices of the upload come first, in order; copies follow. If the result has them, there are also `_CLASS` (0
/// smooth, 1 ridge, 2 corner), `_SIGMA` (standard deviation along the normal, in the unit of the positions) and
/// `_SEGMENT` (of the vertex's faces, −1 for none); vertices are then split between segments too, but normals are
/// not. Primitive 1, lines over the same vertices: the edges with label ≥
/// kRidgeThreshold, if there are any.
///
/// \throw Error mesh_unsupported if a coordinate does not fit into single precision, or for more than 2²⁴ vertices;
///        mesh_no_faces for a mesh without faces
std::string write_glb(const LabelledMesh& result, const nlohmann::ordered_json& extras, const MeshStyle& style);

/// Writes the JSON of write_glb with its buffer embedded as a data URI.
std::string write_gltf(const LabelledMesh& result, const nlohmann::ordered_json& extras, const MeshStyle& style);

/// Writes the upload with the positions of the result, in the frames of the nodes, and its normals recomputed. All else
/// stays. Positions are in single precision, also where the upload has integers. A mesh that several nodes show
/// becomes several, because their results differ. \throw Error mesh_unsupported for meshes that Draco has compressed,
/// for nodes with a flat transform, and as write_glb; mesh_count_mismatch
std::string patch_gltf(std::string_view upload, const LabelledMesh& result);

/// Writes the ridge lines as GLB: one node with one mesh of one primitive. Its lines run over vertices that no two
/// ridge lines share, with POSITION, `_SOURCE` (the vertex of the mesh) and `_LINE` (the number of the ridge line).
/// Without ridge lines the node has no mesh. `extras` goes into asset.extras. \throw Error mesh_unsupported as
/// write_glb
std::string write_ridges_glb(const LabelledMesh& result, const nlohmann::ordered_json& extras);

}  // namespace crease
