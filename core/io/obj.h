#pragma once

#include <string>
#include <string_view>

#include "core/io/format.h"

namespace crease {

Likeness looks_like_obj(const Sample& sample);

/// Reads vertices and faces. Faces may name vertices that follow. Normals, texture coordinates, groups, materials,
/// points, lines and unknown statements are skipped with a warning. \throw Error mesh_* with the line
MeshContent read_obj(std::string_view bytes, const DecodeLimits& limits);

/// Writes positions as the shortest decimal numbers that read back to the same doubles.
std::string write_obj(const Mesh& mesh);

/// The same with a line element (`l`) for each edge whose label is at least kRidgeThreshold.
std::string write_obj_with_ridges(const LabelledMesh& result);

/// Writes the upload with the positions of the result, and its normals (`vn`) recomputed: each is the mean over the
/// corners that name it. All else stays, to the byte. \throw Error mesh_count_mismatch
std::string patch_obj(std::string_view upload, const LabelledMesh& result);

}  // namespace crease
