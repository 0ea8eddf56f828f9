#pragma once

#include <tiny_gltf.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/mesh/mesh.h"

namespace crease {

/// Builds a file of one node with one mesh. Each accessor has its own view of a single buffer.
class GltfBuilder {
 public:
  GltfBuilder() { model_.buffers.emplace_back(); }

  void reserve(std::size_t bytes) { data().reserve(bytes); }

  /// Adds an accessor of floats. With `extent`, it also has the minimum and maximum of each component, as positions
  /// must.
  int add_floats(int type, int components, const std::vector<float>& values, bool extent = false);
  int add_indices(const std::vector<Index>& values);

  /// Adds the positions of the vertices `source` in single precision. Those of a mesh that is far away for its size are
  /// relative to its middle, which becomes the translation of the node, so that they keep their digits.
  /// \throw Error mesh_unsupported
  int add_positions(const Mesh& mesh, const std::vector<Index>& source);
  /// Adds one number per vertex.
  int add_scalars(const std::vector<float>& values) { return add_floats(TINYGLTF_TYPE_SCALAR, 1, values); }

  /// The looks of a surface, matte and grey, and of ridge lines, red under any light.
  int add_surface_material();
  int add_ridge_material();

  /// Writes the file: GLB if `binary`, otherwise glTF. `extras` go into asset.extras. A mesh without primitives is left
  /// out. \throw Error mesh_too_large
  std::string write(tinygltf::Mesh mesh, const nlohmann::ordered_json& extras, bool binary);

 private:
  std::vector<unsigned char>& data() { return model_.buffers.front().data; }

  template <typename Item>
  int add(tinygltf::Accessor accessor, const std::vector<Item>& values, int target);

  tinygltf::Model model_;
  Vec3 origin_ = Vec3::Zero();  ///< of the node
};

/// Checks that float attributes can hold every vertex index: glTF allows no 32-bit integers there, and a float is exact
/// up to 2²⁴. `copies` of the vertices were made by splitting. \throw Error mesh_unsupported if there are more
void check_gltf_vertices(std::size_t vertices, std::size_t copies);

}  // namespace crease
