#pragma once

#include <string>
#include <string_view>

#include "core/io/format.h"

namespace crease {

Likeness looks_like_stl(const Sample& sample);

/// Reads ASCII or binary STL and welds corners that have exactly the same position. \throw Error mesh_* with the line
/// or byte
MeshContent read_stl(std::string_view bytes, const DecodeLimits& limits);

/// Writes binary STL: facets in the order of the faces, in single precision. \throw Error mesh_unsupported if a
/// coordinate does not fit into single precision
std::string write_stl(const LabelledMesh& result, const nlohmann::ordered_json& extras, const MeshStyle& style);

/// Writes the upload with the positions of the result and the facets' normals recomputed, except those that are 0.
/// ASCII stays ASCII; header, names, attribute bytes and what follows the last facet stay, to the byte. \throw Error
/// mesh_unsupported as write_stl, for binary files; mesh_count_mismatch
std::string patch_stl(std::string_view upload, const LabelledMesh& result);

}  // namespace crease
