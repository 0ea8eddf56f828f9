#include "core/io/encode.h"

#include "core/error.h"
#include "core/io/write_formats.h"

namespace crease {

std::string encode_mesh(const LabelledMesh& result, MeshFormat format, const nlohmann::ordered_json& extras) {
  switch (format) {
    case MeshFormat::kObj:
      return write_obj(result.mesh);
    case MeshFormat::kPly:
      return write_ply(result.mesh);
    case MeshFormat::kOff:
      return write_off(result.mesh);
    case MeshFormat::kStl:
      return write_stl(result.mesh);
    case MeshFormat::kGltf:
      return write_gltf(result, extras, false);
    case MeshFormat::kGlb:
      return write_gltf(result, extras, true);
    case MeshFormat::kJson:
      return write_json(result, extras);
  }
  throw Error(code::kOutputFormatUnknown, "no such output format");
}

}  // namespace crease
