#pragma once

#include <string_view>

#include "core/io/decode.h"

namespace crease {

/// The readers behind decode_mesh, one per format: bounded, \throw Error mesh_*. A result may still have no faces.
DecodedMesh read_obj(std::string_view bytes, const DecodeLimits& limits);
DecodedMesh read_off(std::string_view bytes, const DecodeLimits& limits);
DecodedMesh read_ply(std::string_view bytes, const DecodeLimits& limits);
DecodedMesh read_stl(std::string_view bytes, const DecodeLimits& limits);
/// glTF or GLB, whichever the bytes are.
DecodedMesh read_gltf(std::string_view bytes, const DecodeLimits& limits);

}  // namespace crease
