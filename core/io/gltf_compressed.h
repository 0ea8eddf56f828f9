#pragma once

#include <string>
#include <string_view>

#include "core/io/read_gltf_json.h"

namespace crease::gltf {

/// Decodes a buffer view that meshoptimizer has compressed. `extension` is its EXT_meshopt_compression, `compressed`
/// the bytes that this names, `length` the view's byteLength. What the bytes cannot hold is refused before memory is
/// reserved for it. \throw Error mesh_syntax, mesh_count_mismatch with `place`
std::string decode_meshopt(const Json& extension, std::string_view compressed, std::size_t length,
                           const std::string& place);

}  // namespace crease::gltf
