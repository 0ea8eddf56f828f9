#pragma once

#include <string>
#include <string_view>

#include "core/io/format.h"

namespace crease {

Likeness looks_like_off(const Sample& sample);

/// Reads ASCII OFF with or without its keyword. Colours, normals and texture coordinates are skipped. \throw Error
/// mesh_* with the line
MeshContent read_off(std::string_view bytes, const DecodeLimits& limits);

/// Writes positions as the shortest decimal numbers that read back to the same doubles.
std::string write_off(const Mesh& mesh);

}  // namespace crease
