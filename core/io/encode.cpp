#include "core/io/encode.h"

#include <fmt/format.h>

#include "core/error.h"

namespace crease {

std::string encode_mesh(const LabelledMesh& result, MeshFormat format, const nlohmann::ordered_json& extras) {
  const Format& row = format_row(format);
  if (row.write == nullptr) {
    throw Error(code::kOutputFormatUnknown, fmt::format("{} meshes can be read but not written", row.title));
  }
  return row.write(result, extras);
}

}  // namespace crease
