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
  tinygltf::Mesh drawing;
  if (!sources.empty()) {
    check_gltf_vertices(std::max(sources.size(), result.mesh.positions.size()), 0);
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_LINE;
    primitive.attributes["POSITION"] = builder.add_positions(result.mesh, sources);
    primitive.attributes["_SOURCE"] = builder.add_scalars(source_numbers);
    primitive.attributes["_LINE"] = builder.add_scalars(line_numbers);
    primitive.indices = builder.add_indices(indices);
    primitive.material = builder.add_ridge_material();
    drawing.primitives.push_back(std::move(primitive));
  }
  return builder.write(std::move(drawing), extras, true);
}

}  // namespace crease
