#include "core/io/encode.h"

#include <fmt/format.h>

#include "core/error.h"

namespace crease {

std::string encode_mesh(const LabelledMesh& result, MeshFormat format, const nlohmann::ordered_json& extras,
                        const MeshStyle& style) {
  const Format& row = format_row(format);
  if (row.write == nullptr) {
    throw Error(code::kOutputFormatUnknown, fmt::format("{} meshes can be read but not written", row.title));
  }
  return row.write(result, extras, style);
}

std::string encode_original(std::string_view upload, MeshFormat format, const LabelledMesh& result) {
  const Format& row = format_row(format);
  if (row.patch == nullptr) {
    throw Error(code::kOutputFormatUnknown, fmt::format("{} meshes cannot be returned as the original", row.title));
  }
  return row.patch(upload, result);
}

}  // namespace crease
