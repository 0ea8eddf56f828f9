#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "core/io/format.h"

namespace crease {

Likeness looks_like_ply(const Sample& sample);

/// Reads ASCII PLY and both binary encodings, with colours of vertices and faces, and with texture coordinates of
/// vertices (s and t, or u and v) or corners (texcoord). Other elements and properties are skipped with a warning.
/// \throw Error mesh_*, weights_invalid with the line or byte
MeshContent read_ply(std::string_view bytes, const DecodeLimits& limits);

/// Writes binary PLY in little endian with positions in double precision, with a property "sigma" of the vertices if
/// the result has one, and with its edges as elements of vertex1, vertex2, label and dihedral_deg. Colours, texture
/// coordinates and normals are those that the upload had; texture coordinates that differ at a vertex are a list
/// `texcoord` of the faces. `extras` are not written.
std::string write_ply(const LabelledMesh& result, const nlohmann::ordered_json& extras, const MeshStyle& style);

/// Writes the upload with the positions of the result, and the normals (nx, ny, nz) of vertices and faces recomputed
/// where it has them. All else stays, to the byte: encoding, types, other elements and properties. \throw Error
/// mesh_unsupported if coordinates have an integer type, or do not fit into the type; mesh_count_mismatch
std::string patch_ply(std::string_view upload, const LabelledMesh& result);

}  // namespace crease
