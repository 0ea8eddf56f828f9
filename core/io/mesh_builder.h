#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "core/io/format.h"
#include "core/io/vertex_weights.h"

namespace crease {

/// Collects the content of a mesh file and does the checks that all formats share. `place` arguments are functions, so
/// that the text is built only for an error.
class MeshBuilder {
 public:
  explicit MeshBuilder(const DecodeLimits& limits)
      : limits_{std::min<std::size_t>(limits.max_vertices, kNone), limits.max_faces} {}

  std::size_t vertices() const { return mesh_.positions.size(); }
  /// The number of polygons so far, before they become triangles.
  std::size_t faces() const { return faces_; }
  std::string face_place() const { return fmt::format("face {}", faces_); }

  /// Checks the count in a header against the limits and the bytes that are left, then reserves memory for it.
  /// \throw Error mesh_too_large, mesh_truncated
  void expect_vertices(std::size_t count, std::size_t least_bytes_each, std::size_t bytes_left,
                       const std::string& place);
  void expect_faces(std::size_t count, std::size_t least_bytes_each, std::size_t bytes_left, const std::string& place);

  /// Adds a vertex. \throw Error mesh_not_finite, mesh_too_large
  template <typename Place>
  void add_vertex(double x, double y, double z, Place&& place) {
    if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z)) fail_not_finite(place());
    if (vertices() >= limits_.max_vertices) fail_too_large("vertices", limits_.max_vertices, place());
    mesh_.positions.emplace_back(x, y, z);
  }

  /// Sets the weight of a vertex. Vertices without a weight then count as 1. \throw Error weights_invalid
  template <typename Place>
  void set_weight(std::size_t vertex, double weight, Place&& place) {
    if (!is_weight(weight)) fail_weight(vertex, weight, place());
    if (weights_.size() <= vertex) weights_.resize(vertex + 1, 1.0);
    weights_[vertex] = weight;
  }

  /// Adds a face. A polygon becomes a fan around its first corner; finish() mends fans that do not tile it. A face of
  /// fewer than three corners is skipped with a warning. \throw Error mesh_too_large
  template <typename Place>
  void add_face(std::span<const Index> corners, Place&& place) {
    if (corners.size() < 3) {
      if (skipped_faces_++ == 0) first_skipped_ = place();
      ++faces_;
      return;
    }
    if (corners.size() - 2 > limits_.max_faces - mesh_.triangles.size()) {
      fail_too_large("faces", limits_.max_faces, place());
    }
    if (corners.size() > 3) {
      polygons_.push_back({static_cast<Index>(mesh_.triangles.size()), static_cast<Index>(corners.size() - 2)});
    }
    for (std::size_t k = 2; k < corners.size(); ++k) {
      mesh_.triangles.push_back({corners[0], corners[k - 1], corners[k]});
    }
    ++faces_;
  }

  /// Checks a vertex index of the next face, counted from 0, against the `count` vertices.
  /// \throw Error mesh_index_out_of_range
  Index checked_index(std::int64_t index, std::size_t count) const {
    if (index < 0 || static_cast<std::uint64_t>(index) >= count) fail_index(index, count);
    return static_cast<Index>(index);
  }

  /// Notes something that only the original keeps, for the warning attributes_dropped: "groups".
  void drop(std::string_view attribute) {
    std::vector<std::string>& others = appearance_.others;
    if (std::ranges::find(others, attribute) == others.end()) others.emplace_back(attribute);
  }

  Appearance& appearance() { return appearance_; }
  /// Gives the corners of the face that was added last numbers of texture coordinates, kNone for none. All faces
  /// without have none.
  void add_texture(std::span<const Index> numbers);
  /// Gives the face that was added last a colour. Colours that not all faces have are dropped.
  void add_face_colour(const Colour& colour) { appearance_.face_colours.resize(mesh_.triangles.size(), colour); }
  /// The faces from the next on have this material.
  void start_material(Index material);

  void warn(std::string_view code, std::string detail) { warnings_.push_back({std::string(code), std::move(detail)}); }

  Mesh& mesh() { return mesh_; }
  /// The weights of the vertices so far, or empty.
  std::vector<double>& weights() {
    if (!weights_.empty()) weights_.resize(vertices(), 1.0);
    return weights_;
  }
  const DecodeLimits& limits() const { return limits_; }

  /// Returns the collected content with its warnings, polygons as triangles.
  MeshContent finish();

  [[noreturn]] static void fail_too_large(std::string_view what, std::size_t limit, const std::string& place);

 private:
  [[noreturn]] static void fail_not_finite(const std::string& place);
  [[noreturn]] void fail_index(std::int64_t index, std::size_t count) const;
  void tile_polygons();
  void settle_appearance();
  void move_texture(std::size_t first, std::span<const Triangle> fan);

  /// A face of more than three corners.
  struct Polygon {
    Index first;  ///< of its triangles
    Index count;
  };

  DecodeLimits limits_;
  Mesh mesh_;
  std::vector<double> weights_;
  std::size_t faces_ = 0;
  std::vector<Polygon> polygons_;
  std::size_t skipped_faces_ = 0;
  std::string first_skipped_;
  Appearance appearance_;
  std::vector<Warning> warnings_;
};

/// "1 vertex", "2 vertices".
std::string counted(std::size_t count, std::string_view singular, std::string_view plural);

}  // namespace crease
