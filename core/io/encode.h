#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "core/io/formats.h"
#include "core/io/labelled_mesh.h"

namespace crease {

/// The mesh in `format`; the same result gives the same bytes. `extras` goes where the format has room for it: into
/// asset.extras of glTF and GLB and into "extras" of JSON; `style` has an effect where the format leaves the choice.
/// \throw Error output_format_unknown for a format that is only read, and what its writer throws: mesh_unsupported,
///        mesh_no_faces
std::string encode_mesh(const LabelledMesh& result, MeshFormat format, const nlohmann::ordered_json& extras = {},
                        const MeshStyle& style = {});

/// The upload, which is in `format`, with the positions of the result: see Format::patch.
/// \throw Error mesh_unsupported for what the file's own types cannot hold, mesh_count_mismatch for another upload
std::string encode_original(std::string_view upload, MeshFormat format, const LabelledMesh& result);

}  // namespace crease
