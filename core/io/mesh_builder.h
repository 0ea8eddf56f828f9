#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "core/io/format.h"
#include "core/io/vertex_weights.h"

namespace crease {

/// Collects what a reader finds, under the limits: the checks that all formats share.
/// `place` arguments are callables that make the place of a fault only when there is one.
class MeshBuilder {
 public:
  explicit MeshBuilder(const DecodeLimits& limits)
      : limits_{std::min<std::size_t>(limits.max_vertices, kNone), limits.max_faces} {}

  std::size_t vertices() const { return mesh_.positions.size(); }
  /// Polygons of the file so far, before they become triangles.
  std::size_t faces() const { return faces_; }
  std::string face_place() const { return fmt::format("face {}", faces_); }

  /// Reserves what a header promises after checking it against the limits and the bytes that are left.
  /// \throw Error mesh_too_large, mesh_truncated
  void expect_vertices(std::size_t count, std::size_t least_bytes_each, std::size_t bytes_left,
                       const std::string& place);
  void expect_faces(std::size_t count, std::size_t least_bytes_each, std::size_t bytes_left, const std::string& place);

  /// \throw Error mesh_not_finite, mesh_too_large
  template <typename Place>
  void add_vertex(double x, double y, double z, Place&& place) {
    if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z)) fail_not_finite(place());
    if (vertices() >= limits_.max_vertices) fail_too_large("vertices", limits_.max_vertices, place());
    mesh_.positions.emplace_back(x, y, z);
  }

  /// The weight of a vertex. Once one has a weight, those that are given none have 1. \throw Error weights_invalid
  template <typename Place>
  void set_weight(std::size_t vertex, double weight, Place&& place) {
    if (!is_weight(weight)) fail_weight(vertex, weight, place());
    if (weights_.size() <= vertex) weights_.resize(vertex + 1, 1.0);
    weights_[vertex] = weight;
  }

  /// A face of at least three corners; more become a fan around the first.
  /// \throw Error mesh_syntax for fewer, mesh_too_large
  template <typename Place>
  void add_face(std::span<const Index> corners, Place&& place) {
    if (corners.size() < 3) fail_few_corners(corners.size(), place());
    if (corners.size() - 2 > limits_.max_faces - mesh_.triangles.size()) {
      fail_too_large("faces", limits_.max_faces, place());
    }
    for (std::size_t k = 2; k < corners.size(); ++k) {
      mesh_.triangles.push_back({corners[0], corners[k - 1], corners[k]});
    }
    if (corners.size() > 3) count_polygon(corners.size());
    ++faces_;
  }

  /// The vertex that the next face names, counted from 0 among `count`. \throw Error mesh_index_out_of_range
  Index checked_index(std::int64_t index, std::size_t count) const {
    if (index < 0 || static_cast<std::uint64_t>(index) >= count) fail_index(index, count);
    return static_cast<Index>(index);
  }

  void warn(std::string_view code, std::string detail) { warnings_.push_back({std::string(code), std::move(detail)}); }

  Mesh& mesh() { return mesh_; }
  /// Of the vertices so far, or empty.
  std::vector<double>& weights() {
    if (!weights_.empty()) weights_.resize(vertices(), 1.0);
    return weights_;
  }
  const DecodeLimits& limits() const { return limits_; }

  /// What has been collected, with the warnings.
  MeshContent finish();

  [[noreturn]] static void fail_too_large(std::string_view what, std::size_t limit, const std::string& place);

 private:
  [[noreturn]] static void fail_not_finite(const std::string& place);
  [[noreturn]] static void fail_few_corners(std::size_t corners, const std::string& place);
  [[noreturn]] void fail_index(std::int64_t index, std::size_t count) const;
  void count_polygon(std::size_t corners) {
    ++polygons_;
    polygon_triangles_ += corners - 2;
  }

  DecodeLimits limits_;
  Mesh mesh_;
  std::vector<double> weights_;
  std::size_t faces_ = 0;
  std::size_t polygons_ = 0;
  std::size_t polygon_triangles_ = 0;
  std::vector<Warning> warnings_;
};

/// "1 vertex", "2 vertices".
std::string counted(std::size_t count, std::string_view singular, std::string_view plural);

}  // namespace crease
