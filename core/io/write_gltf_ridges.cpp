#include <algorithm>

#include "core/io/gltf.h"
#include "core/io/gltf_builder.h"

namespace crease {

std::string write_ridges_glb(const LabelledMesh& result, const nlohmann::ordered_json& extras) {
  const std::vector<RidgeLine>& lines = result.ridge_lines;
  std::vector<Index> sources, indices;
  std::vector<float> source_numbers, line_numbers;
  for (std::size_t number = 0; number < lines.size(); ++number) {
    const auto first = static_cast<Index>(sources.size());
    for (const Index vertex : lines[number].vertices) {
      const auto here = static_cast<Index>(sources.size());
      if (here != first) indices.insert(indices.end(), {here - 1, here});
      sources.push_back(vertex);
      source_numbers.push_back(static_cast<float>(vertex));
      line_numbers.push_back(static_cast<float>(number));
    }
    if (lines[number].closed) indices.insert(indices.end(), {static_cast<Index>(sources.size() - 1), first});
  }

  GltfBuilder builder;
  GltfBuilder::Json primitives = GltfBuilder::Json::array();
  if (!sources.empty()) {
    constexpr int kLines = 1;
    check_gltf_vertices(std::max(sources.size(), result.mesh.positions.size()), 0);
    const GltfBuilder::Json attributes = {{"POSITION", builder.add_positions(result.mesh, sources)},
                                          {"_SOURCE", builder.add_floats(source_numbers)},
                                          {"_LINE", builder.add_floats(line_numbers)}};
    primitives.push_back({{"mode", kLines},
                          {"attributes", attributes},
                          {"indices", builder.add_indices(indices)},
                          {"material", builder.add_material(ridge_material())}});
  }
  return builder.write(std::move(primitives), extras, true);
}

}  // namespace crease
