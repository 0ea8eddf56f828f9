#pragma once

#include <array>
#include <cstdint>

namespace crease::gltf {

// The numbers and names of glTF that its reader and its writers have in common.

enum class Component : std::uint16_t {
  kInt8 = 5120,
  kUint8 = 5121,
  kInt16 = 5122,
  kUint16 = 5123,
  kUint32 = 5125,
  kFloat = 5126,
};

/// What a buffer view is for.
enum class Target : std::uint16_t { kVertexData = 34962, kIndexData = 34963 };

inline constexpr const char *kMeshopt = "EXT_meshopt_compression", *kQuantization = "KHR_mesh_quantization",
                            *kDraco = "KHR_draco_mesh_compression";
/// The extensions that change how data is stored, and nothing else.
inline constexpr std::array<const char*, 3> kOfStorage{kMeshopt, kQuantization, kDraco};
inline constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";

}  // namespace crease::gltf
