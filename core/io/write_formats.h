#pragma once

#include <string>

#include "core/io/encode.h"

namespace crease {

/// The writers behind encode_mesh, one per format.
std::string write_obj(const Mesh& mesh);
std::string write_off(const Mesh& mesh);
std::string write_ply(const Mesh& mesh);
std::string write_stl(const Mesh& mesh);
std::string write_json(const LabelledMesh& result, const nlohmann::ordered_json& extras);
/// GLB when `binary`, otherwise glTF.
std::string write_gltf(const LabelledMesh& result, const nlohmann::ordered_json& extras, bool binary);

}  // namespace crease
