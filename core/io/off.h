#pragma once

#include <string>
#include <string_view>

#include "core/io/format.h"

namespace crease {

Likeness looks_like_off(const Sample& sample);

/// Reads ASCII OFF with or without its keyword, and the colours of vertices and faces. Texture coordinates are skipped.
/// A vertex or face ends with its line; in a file that has several on a line, numbers are told apart by their count.
/// \throw Error mesh_* with the line
MeshContent read_off(std::string_view bytes, const DecodeLimits& limits);

/// Writes positions as the shortest decimal numbers that read back to the same doubles, with the colours, from 0 to
/// 255, and the normals that the upload had.
std::string write_off(const LabelledMesh& result, const nlohmann::ordered_json& extras, const MeshStyle& style);

/// Writes the upload with the positions of the result, and the normals of the vertices, if it has them, recomputed. All
/// else stays, to the byte. \throw Error mesh_count_mismatch
std::string patch_off(std::string_view upload, const LabelledMesh& result);

}  // namespace crease
