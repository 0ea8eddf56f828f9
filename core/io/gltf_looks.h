#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/gltf_layout.h"
#include "core/io/mesh_builder.h"

namespace crease {

/// Reads the colours and texture coordinates of a glTF file: COLOR_0, and TEXCOORD_0 and up.
class GltfLooks {
 public:
  GltfLooks(const gltf::Document& document, MeshBuilder& builder) : document_(document), builder_(builder) {}

  /// Whether the attribute of a primitive with these attributes is read.
  static bool is_read(std::string_view name, const gltf::Json& attributes);

  /// The accessors that a primitive has, in a fixed order.
  static std::vector<std::size_t> accessors(const gltf::Json& attributes, const std::string& place);

  /// Reads those of a range of vertices. \throw Error mesh_syntax, mesh_count_mismatch
  void read(const gltf::Json& attributes, const VertexRange& range, const std::string& place);

  /// Gives them to the corners of faces. To be called before vertices are shared.
  void finish();

 private:
  void read_colours(std::size_t index, const VertexRange& range, const std::string& place);
  void read_texture(std::size_t index, std::size_t set, const VertexRange& range, const std::string& place);
  gltf::Accessor checked(std::size_t index, std::size_t least, std::size_t most, const VertexRange& range,
                         const std::string& place) const;

  const gltf::Document& document_;
  MeshBuilder& builder_;
};

/// Reads the materials that the faces of a glTF file have, and what these refer to.
class GltfMaterials {
 public:
  GltfMaterials(const gltf::Document& document, MeshBuilder& builder) : document_(document), builder_(builder) {}

  /// The faces from the next on have the material of the primitive. \throw Error mesh_index_out_of_range
  void start(const gltf::Json& primitive, const std::string& place);

  void finish();

 private:
  Index number_of(std::size_t index, const std::string& place);
  void read_textures();
  gltf::Json read_image(const gltf::Json& image, const std::string& place);
  void note_extensions() const;

  const gltf::Document& document_;
  MeshBuilder& builder_;
  std::map<std::size_t, Index> numbers_;            ///< by their place in the file
  std::map<std::size_t, std::size_t> image_views_;  ///< where the image in a view is among those that were read
};

}  // namespace crease
