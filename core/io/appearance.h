#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/mesh/mesh.h"

namespace crease {

/// Names of attributes that some formats keep and others do not.
inline constexpr std::string_view kVertexColours = "vertex colours", kOpacity = "opacity of colours",
                                  kCornerColours = "colours that differ at one vertex",
                                  kTextureCoordinates = "texture coordinates",
                                  kFurtherTexture = "further texture coordinates", kFaceColours = "face colours",
                                  kMaterialNames = "material names", kMaterials = "materials", kTextures = "textures",
                                  kMaterialLibraries = "material libraries";

/// Values of N numbers at the corners of faces.
template <std::size_t N>
struct CornerValues {
  using Value = std::array<float, N>;

  std::vector<Value> values;
  /// Per face, the values of its corners, kNone for none. Empty: value v is that of vertex v.
  std::vector<Triangle> corners{};

  bool empty() const { return values.empty(); }
  /// The value at a corner of a face, or kNone.
  Index at(const std::vector<Triangle>& triangles, std::size_t face, std::size_t place) const {
    return corners.empty() ? triangles[face][place] : corners[face][place];
  }
};

/// Red, green, blue and opacity, from 0 to 1.
using Colour = std::array<float, 4>;

struct Material {
  std::string name;    ///< may be empty
  std::string json{};  ///< its object in glTF; empty if only the name is known
};

/// Faces with the same material, one after another.
struct MaterialRun {
  Index first_face;
  Index material;  ///< kNone for none
};

/// What the materials of a glTF file refer to.
struct GltfParts {
  /// An object with its `textures`, `samplers` and `images`, or empty. The `bufferView` of an image is its place in
  /// `images`.
  std::string textures{};
  std::vector<std::string> images{};
  std::vector<std::string> extensions_used{}, extensions_required{};
};

/// What a mesh file has beside the shape of its surface.
struct Appearance {
  CornerValues<4> colours{};
  std::vector<CornerValues<2>> texture{};  ///< sets of texture coordinates
  /// Colours are linear and texture coordinates start at the top, as in glTF; otherwise colours are sRGB and texture
  /// coordinates start at the bottom, as elsewhere.
  bool as_gltf = false;
  std::vector<Colour> face_colours{};  ///< per face, or empty
  std::vector<Material> materials{};
  std::vector<MaterialRun> material_runs{};  ///< ascending by their first face
  std::vector<std::string> material_libraries{};
  GltfParts gltf{};
  bool has_normals = false;
  std::vector<std::string> others{};  ///< names of what only the original keeps
};

/// The names of everything that not every format of meshes keeps, such as "texture coordinates". `triangles` are those
/// of the mesh.
std::vector<std::string> attributes_of(const Appearance& appearance, const std::vector<Triangle>& triangles);

/// The same colour with linear red, green and blue, and back. Opacity is linear in both.
Colour linear_from_srgb(const Colour& colour);
Colour srgb_from_linear(const Colour& colour);

/// The colours as sRGB, and the texture coordinates from the bottom, or as in glTF.
std::vector<Colour> colours_of(const Appearance& appearance, bool as_gltf);
std::vector<std::array<float, 2>> texture_of(const Appearance& appearance, std::size_t set, bool as_gltf);

/// One colour per vertex: that of its first corner, or opaque white. Empty without colours.
std::vector<Colour> vertex_colours(const Appearance& appearance, const Mesh& mesh, bool as_gltf);

/// The texture coordinates of each vertex, from the bottom; empty where those of its corners differ or are missing.
std::vector<std::array<float, 2>> vertex_texture(const Appearance& appearance, const Mesh& mesh);

/// Whether any of the colours is transparent.
bool has_opacity(const std::vector<Colour>& colours);

/// From 0 to 1 as 0 to 255.
std::uint8_t byte_of(float value);

/// The material of each face as runs that cover all faces.
std::vector<MaterialRun> covering_runs(const Appearance& appearance, std::size_t faces);

/// The name of a material as one line; "material_N" without a name.
std::string name_of(const Appearance& appearance, Index material);

}  // namespace crease
