#pragma once

#include <tiny_gltf.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/mesh/mesh.h"

namespace crease {

/// Collects accessors over one buffer, each with a view of its own, for a file of one node with one mesh.
class GltfBuilder {
 public:
  GltfBuilder() { model_.buffers.emplace_back(); }

  void reserve(std::size_t bytes) { data().reserve(bytes); }

  /// Components of floats; `extent` writes the smallest and largest value of each, as positions need.
  int add_floats(int type, int components, const std::vector<float>& values, bool extent = false);
  int add_indices(const std::vector<Index>& values);

  /// The positions of the vertices `source`, in single precision. \throw Error mesh_unsupported
  int add_positions(const Mesh& mesh, const std::vector<Index>& source);
  /// One number for each vertex.
  int add_scalars(const std::vector<float>& values) { return add_floats(TINYGLTF_TYPE_SCALAR, 1, values); }

  /// The file: GLB when `binary`, otherwise glTF; `extras` become asset.extras. A mesh without primitives is left out.
  /// \throw Error mesh_too_large
  std::string write(tinygltf::Mesh mesh, const nlohmann::ordered_json& extras, bool binary);

 private:
  std::vector<unsigned char>& data() { return model_.buffers.front().data; }

  template <typename Item>
  int add(tinygltf::Accessor accessor, const std::vector<Item>& values, int target);

  tinygltf::Model model_;
};

/// Vertex attributes cannot be 32-bit integers in glTF, and a float holds integers exactly up to 2²⁴.
/// \throw Error mesh_unsupported when there are more vertices, `copies` of them made by us
void check_gltf_vertices(std::size_t vertices, std::size_t copies);

}  // namespace crease
