#include "core/io/appearance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/text.h"

namespace crease {
namespace {

/// Whether two corners of one vertex have different colours.
bool differ_at_vertices(const CornerValues<4>& colours, const std::vector<Triangle>& triangles) {
  if (colours.corners.empty()) return false;
  std::vector<Index> first;
  for (std::size_t face = 0; face < triangles.size(); ++face) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index vertex = triangles[face][k], colour = colours.corners[face][k];
      if (vertex >= first.size()) first.resize(vertex + std::size_t{1}, kNone);
      if (first[vertex] == kNone) first[vertex] = colour;
      if (colours.values[first[vertex]] != colours.values[colour]) return true;
    }
  }
  return false;
}

/// IEC 61966-2-1.
float linear_component(float srgb) {
  return srgb <= 0.04045F ? srgb / 12.92F : std::pow((srgb + 0.055F) / 1.055F, 2.4F);
}
float srgb_component(float linear) {
  return linear <= 0.0031308F ? linear * 12.92F : 1.055F * std::pow(linear, 1 / 2.4F) - 0.055F;
}

}  // namespace

std::vector<std::string> attributes_of(const Appearance& appearance, const std::vector<Triangle>& triangles) {
  std::vector<std::string> names = appearance.others;
  const auto add = [&](std::string_view name, bool present) {
    if (present) names.emplace_back(name);
  };
  add(kVertexColours, !appearance.colours.empty());
  add(kOpacity, has_opacity(appearance.colours.values) || has_opacity(appearance.face_colours));
  add(kCornerColours, differ_at_vertices(appearance.colours, triangles));
  add(kFaceColours, !appearance.face_colours.empty());
  add(kTextureCoordinates, !appearance.texture.empty());
  add(kFurtherTexture, appearance.texture.size() > 1);
  const bool have_looks =
      std::ranges::any_of(appearance.materials, [](const Material& material) { return !material.json.empty(); });
  add(kMaterialNames, !appearance.material_runs.empty());
  add(kMaterials, have_looks);
  add(kTextures, !appearance.gltf.textures.empty());
  add(kMaterialLibraries, !appearance.material_libraries.empty());
  return names;
}

Colour linear_from_srgb(const Colour& colour) {
  return {linear_component(colour[0]), linear_component(colour[1]), linear_component(colour[2]), colour[3]};
}

Colour srgb_from_linear(const Colour& colour) {
  return {srgb_component(colour[0]), srgb_component(colour[1]), srgb_component(colour[2]), colour[3]};
}

std::vector<Colour> colours_of(const Appearance& appearance, bool as_gltf) {
  std::vector<Colour> colours = appearance.colours.values;
  if (as_gltf == appearance.as_gltf) return colours;
  for (Colour& colour : colours) colour = as_gltf ? linear_from_srgb(colour) : srgb_from_linear(colour);
  return colours;
}

std::vector<std::array<float, 2>> texture_of(const Appearance& appearance, std::size_t set, bool as_gltf) {
  std::vector<std::array<float, 2>> texture = appearance.texture.at(set).values;
  if (as_gltf == appearance.as_gltf) return texture;
  for (auto& [u, v] : texture) v = 1 - v;
  return texture;
}

std::vector<Colour> vertex_colours(const Appearance& appearance, const Mesh& mesh, bool as_gltf) {
  std::vector<Colour> colours = colours_of(appearance, as_gltf);
  if (colours.empty() || appearance.colours.corners.empty()) return colours;
  std::vector<Colour> of_vertices(mesh.positions.size(), Colour{1, 1, 1, 1});
  for (std::size_t face = mesh.triangles.size(); face-- > 0;) {
    for (std::size_t k = 3; k-- > 0;)
      of_vertices[mesh.triangles[face][k]] = colours[appearance.colours.corners[face][k]];
  }
  return of_vertices;
}

std::vector<std::array<float, 2>> vertex_texture(const Appearance& appearance, const Mesh& mesh) {
  const std::vector<std::array<float, 2>> texture = texture_of(appearance, 0, false);
  const std::vector<Triangle>& corners = appearance.texture.front().corners;
  if (corners.empty()) return texture;
  std::vector<std::array<float, 2>> of_vertices(mesh.positions.size(), std::array<float, 2>{0, 0});
  std::vector<bool> known(mesh.positions.size(), false);
  for (std::size_t face = 0; face < corners.size(); ++face) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index vertex = mesh.triangles[face][k], number = corners[face][k];
      if (number == kNone || (known[vertex] && of_vertices[vertex] != texture[number])) return {};
      of_vertices[vertex] = texture[number];
      known[vertex] = true;
    }
  }
  return of_vertices;
}

bool has_opacity(const std::vector<Colour>& colours) {
  return std::ranges::any_of(colours, [](const Colour& colour) { return colour[3] != 1; });
}

std::uint8_t byte_of(float value) { return static_cast<std::uint8_t>(std::lround(255 * value)); }

std::vector<MaterialRun> covering_runs(const Appearance& appearance, std::size_t faces) {
  std::vector<MaterialRun> runs = appearance.material_runs;
  if (faces > 0 && (runs.empty() || runs.front().first_face != 0)) runs.insert(runs.begin(), {0, kNone});
  return runs;
}

std::string name_of(const Appearance& appearance, Index material) {
  const std::string& name = appearance.materials.at(material).name;
  if (name.empty()) return fmt::format("material_{}", material);
  std::string line = valid_utf8(name);
  std::ranges::replace_if(
      line, [](char c) { return c >= 0 && c < ' '; }, '_');
  return line;
}

}  // namespace crease
