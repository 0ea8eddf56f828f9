#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <optional>

#include "core/io/corner_normals.h"
#include "core/io/ply.h"
#include "core/io/write_number.h"

namespace crease {
namespace {

/// Writes the mesh with what PLY keeps of the look of its upload.
class PlyWriter {
 public:
  explicit PlyWriter(const LabelledMesh& result)
      : result_(result), look_(result.appearance), colours_(vertex_colours(look_, result.mesh, false)) {
    if (look_.has_normals) normals_.emplace(result, result.mesh.positions.size()).add_vertices();
    colour_parts_ = parts_of(colours_);
    face_colour_parts_ = parts_of(look_.face_colours);
    if (look_.texture.empty()) return;
    vertex_texture_ = vertex_texture(look_, result.mesh);
    if (vertex_texture_.empty()) corner_texture_ = texture_of(look_, 0, false);
  }

  std::string write() {
    bytes_ = header();
    bytes_.reserve(bytes_.size() + 64 * result_.mesh.positions.size() + 45 * result_.mesh.triangles.size() +
                   16 * result_.edges.size());
    for (std::size_t vertex = 0; vertex < result_.mesh.positions.size(); ++vertex) write_vertex(vertex);
    for (std::size_t face = 0; face < result_.mesh.triangles.size(); ++face) write_face(face);
    for (std::size_t e = 0; e < result_.edges.size(); ++e) {
      append_little_endian(bytes_, result_.edges[e].v0);
      append_little_endian(bytes_, result_.edges[e].v1);
      append_little_endian(bytes_, static_cast<float>(result_.labels[e]));
      append_little_endian(bytes_, static_cast<float>(result_.dihedral_rad[e] * 180 / std::numbers::pi));
    }
    return std::move(bytes_);
  }

 private:
  static std::string properties(std::string_view type, std::initializer_list<std::string_view> names) {
    std::string lines;
    for (const std::string_view name : names) lines += fmt::format("property {} {}\n", type, name);
    return lines;
  }

  /// How many numbers a colour has.
  static std::size_t parts_of(const std::vector<Colour>& colours) {
    if (colours.empty()) return 0;
    return has_opacity(colours) ? 4 : 3;
  }

  static std::string colour_properties(std::size_t parts) {
    constexpr std::array<std::string_view, 4> kNames{"red", "green", "blue", "alpha"};
    std::string lines;
    for (std::size_t k = 0; k < parts; ++k) lines += properties("uchar", {kNames[k]});
    return lines;
  }

  std::string header() const {
    std::string lines = "ply\nformat binary_little_endian 1.0\n";
    lines += fmt::format("element vertex {}\n", result_.mesh.positions.size()) + properties("double", {"x", "y", "z"});
    if (!result_.sigma.empty()) lines += properties("double", {"sigma"});
    if (normals_) lines += properties("float", {"nx", "ny", "nz"});
    lines += colour_properties(colour_parts_);
    if (!vertex_texture_.empty()) lines += properties("float", {"s", "t"});
    lines += fmt::format("element face {}\n", result_.mesh.triangles.size());
    lines += properties("list uchar uint", {"vertex_indices"}) + colour_properties(face_colour_parts_);
    if (!corner_texture_.empty()) lines += properties("list uchar float", {"texcoord"});
    if (!result_.edges.empty()) {
      lines += fmt::format("element edge {}\n", result_.edges.size()) + properties("uint", {"vertex1", "vertex2"}) +
               properties("float", {"label", "dihedral_deg"});
    }
    return lines + "end_header\n";
  }

  template <typename Vector>
  void append_floats(const Vector& vector) {
    for (const auto value : vector) append_little_endian(bytes_, static_cast<float>(value));
  }

  void append_colour(const Colour& colour, std::size_t parts) {
    for (std::size_t k = 0; k < parts; ++k) append_little_endian(bytes_, byte_of(colour[k]));
  }

  void write_vertex(std::size_t vertex) {
    for (const double coordinate : result_.mesh.positions[vertex]) append_little_endian(bytes_, coordinate);
    if (!result_.sigma.empty()) append_little_endian(bytes_, result_.sigma[vertex]);
    if (normals_) append_floats((*normals_)[vertex].value_or(Vec3::UnitZ()));
    if (colour_parts_ > 0) append_colour(colours_[vertex], colour_parts_);
    if (!vertex_texture_.empty()) append_floats(vertex_texture_[vertex]);
  }

  void write_face(std::size_t face) {
    const std::vector<Triangle>& triangles = result_.mesh.triangles;
    append_little_endian(bytes_, std::uint8_t{3});
    for (const Index corner : triangles[face]) append_little_endian(bytes_, corner);
    if (face_colour_parts_ > 0) append_colour(look_.face_colours[face], face_colour_parts_);
    if (corner_texture_.empty()) return;
    const Triangle& numbers = look_.texture.front().corners[face];
    const bool has_texture = std::ranges::find(numbers, kNone) == numbers.end();
    append_little_endian(bytes_, static_cast<std::uint8_t>(has_texture ? 6 : 0));
    for (std::size_t k = 0; k < 3 && has_texture; ++k) append_floats(corner_texture_[numbers[k]]);
  }

  const LabelledMesh& result_;
  const Appearance& look_;
  std::vector<Colour> colours_;
  std::optional<NormalMeans> normals_;
  std::size_t colour_parts_ = 0, face_colour_parts_ = 0;
  std::vector<std::array<float, 2>> vertex_texture_, corner_texture_;  ///< at most one of them has any
  std::string bytes_;
};

}  // namespace

std::string write_ply(const LabelledMesh& result, const nlohmann::ordered_json& /*extras*/,
                      const MeshStyle& /*style*/) {
  return PlyWriter(result).write();
}

}  // namespace crease
