#pragma once

#include <string>
#include <string_view>

#include "core/io/format.h"

namespace crease {

Likeness looks_like_obj(const Sample& sample);

/// Reads vertices and faces. Faces may name vertices that follow. Normals, texture coordinates, groups and materials
/// are skipped silently; points, lines and unknown statements with a warning. \throw Error mesh_* with the line
MeshContent read_obj(std::string_view bytes, const DecodeLimits& limits);

/// Writes positions as the shortest decimal numbers that read back to the same doubles.
std::string write_obj(const Mesh& mesh);

}  // namespace crease
