#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/io/appearance.h"
#include "core/io/format.h"
#include "core/mesh/mesh.h"

namespace crease {

/// Builds a file of one node with one mesh. Each accessor has its own view of a single buffer; when it is compressed,
/// of a second one that nobody has to load.
class GltfBuilder {
 public:
  using Json = nlohmann::ordered_json;

  explicit GltfBuilder(const MeshStyle& style = {}) : style_(style) {}

  void reserve(std::size_t bytes) { data_.reserve(bytes); }

  /// The number of an accessor with `components` floats for each vertex.
  std::size_t add_floats(const std::vector<float>& values, std::size_t components = 1);
  std::size_t add_indices(const std::vector<Index>& values);
  std::size_t add_normals(const std::vector<Vec3>& normals);
  std::size_t add_colours(const std::vector<Colour>& colours);

  /// Adds the positions of the vertices `source` in single precision. Those of a mesh that is far away for its size are
  /// relative to its middle, which becomes the translation of the node, so that they keep their digits. Quantised, they
  /// are whole numbers up to 65535, which the node scales to the longest side of the mesh.
  /// \throw Error mesh_unsupported
  std::size_t add_positions(const Mesh& mesh, const std::vector<Index>& source);

  std::size_t add_material(Json material);
  /// What materials of an upload refer to. To be added once.
  void add_parts(const GltfParts& parts);

  /// Writes the file: GLB if `binary`, otherwise glTF. `extras` go into asset.extras. A mesh without primitives is left
  /// out. \throw Error mesh_too_large
  std::string write(Json primitives, const nlohmann::ordered_json& extras, bool binary);

 private:
  /// The bytes of `count` elements, each of `stride` bytes.
  struct Elements {
    std::string bytes;
    std::size_t count, stride;
    bool are_indices = false;
  };

  std::size_t add(Json accessor, const Elements& elements);
  std::size_t add_view(const Elements& elements);
  void compress(const Elements& elements, Json& view);
  void use_extension(const std::string& name, bool required);
  std::string finish(bool binary);

  MeshStyle style_;
  Json json_ = Json::object();
  std::string data_;
  std::size_t fallback_bytes_ = 0;
  Vec3 origin_ = Vec3::Zero();  ///< of the node
  double scale_ = 1;            ///< of the node
};

/// The looks of a surface, matte, and of ridge lines, red under any light. A surface is grey, unless it has colours.
nlohmann::ordered_json surface_material(bool has_colours);
nlohmann::ordered_json ridge_material();
/// Whether a material of a file is one of these.
bool is_own_material(const nlohmann::json& material);

/// Checks that float attributes can hold every vertex index: glTF allows no 32-bit integers there, and a float is exact
/// up to 2²⁴. `copies` of the vertices were made by splitting. \throw Error mesh_unsupported if there are more
void check_gltf_vertices(std::size_t vertices, std::size_t copies);

}  // namespace crease
