#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/io/read_gltf_document.h"

namespace crease::gltf {

/// An attribute of a primitive that Draco has compressed, as its accessor describes it.
struct DracoAttribute {
  std::uint32_t id = 0;  ///< in the compressed data
  Component component = Component::kFloat;
  std::size_t components = 1;
  std::size_t count = 0;
  std::string place;
};

/// What a primitive has once it is decoded.
struct DracoPrimitive {
  std::vector<std::string> attributes;  ///< the elements of each attribute, one after another
  std::vector<std::uint32_t> indices;   ///< of triangles
};

/// Decodes a primitive. Counts beyond the limits are refused before memory is reserved for them.
/// \throw Error mesh_too_large; mesh_syntax, mesh_count_mismatch with the place of the attribute or `place`
DracoPrimitive decode_draco(std::string_view compressed, const std::vector<DracoAttribute>& attributes,
                            const DecodeLimits& limits, const std::string& place);

}  // namespace crease::gltf
