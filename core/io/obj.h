#pragma once

#include <string>
#include <string_view>

#include "core/io/format.h"

namespace crease {

Likeness looks_like_obj(const Sample& sample);

/// Reads vertices and faces, and colours behind positions, texture coordinates and the names of materials. Faces may
/// name vertices that follow. Groups, points, lines and unknown statements are skipped with a warning.
/// \throw Error mesh_* with the line
MeshContent read_obj(std::string_view bytes, const DecodeLimits& limits);

/// Writes positions as the shortest decimal numbers that read back to the same doubles, with the colours, texture
/// coordinates, materials and normals that the upload had, and optionally a line element (`l`) for each edge whose
/// label is at least kRidgeThreshold.
std::string write_obj(const LabelledMesh& result, const nlohmann::ordered_json& extras, const MeshStyle& style);

/// Writes the upload with the positions of the result, and its normals (`vn`) recomputed: each is the mean over the
/// corners that name it. All else stays, to the byte. \throw Error mesh_count_mismatch
std::string patch_obj(std::string_view upload, const LabelledMesh& result);

}  // namespace crease
