#include "core/mesh/welded_mesh.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_map>

#include "core/mesh/face_vectors.h"
#include "core/mesh/position_index.h"

namespace crease {
namespace {

/// Whether the height of a triangle is more than rounding. Decimal coordinates of collinear points make triangles with
/// heights of some 1e-16 of the coordinates.
bool is_more_than_rounding(const Vec3& a, const Vec3& b, const Vec3& c) {
  constexpr double kLeastHeight = 1e-12, kLargestHeight = 1e-8;
  const double scale = std::max((b - a).lpNorm<Eigen::Infinity>(), (c - a).lpNorm<Eigen::Infinity>());
  if (!std::isfinite(scale)) return true;
  if (!(scale > 0)) return false;
  const Vec3 u = (b - a) / scale, v = (c - a) / scale;
  const double rounding = 4 * std::numeric_limits<double>::epsilon() * a.lpNorm<Eigen::Infinity>() / scale;
  const double longest = std::max({u.squaredNorm(), v.squaredNorm(), (v - u).squaredNorm()});
  return u.cross(v).norm() > std::clamp(rounding, kLeastHeight, kLargestHeight) * longest;
}

bool has_area(const std::vector<Vec3>& positions, const Triangle& triangle) {
  const Vec3 &a = positions[triangle[0]], &b = positions[triangle[1]], &c = positions[triangle[2]];
  constexpr double kClearly = 1e-14;  // of the squared sine of an angle
  const double longest = std::max((b - a).squaredNorm(), (c - a).squaredNorm());
  return area_vector(a, b, c).squaredNorm() > kClearly * longest * longest || is_more_than_rounding(a, b, c);
}

bool repeats_a_corner(const Triangle& triangle) {
  return triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0];
}

/// Finds triangles by their three vertices in any order.
class TriangleIndex {
 public:
  explicit TriangleIndex(std::size_t count) : slots_(std::bit_ceil(2 * count + 1), kNone) {}

  /// Returns the first triangle added with the vertices of `face`, and adds `face` if there is none.
  Index find_or_add(const std::vector<Triangle>& triangles, Index face) {
    const Triangle sorted = in_order(triangles[face]);
    const std::size_t mask = slots_.size() - 1;
    std::size_t at = salted_hash(sorted[0], sorted[1], sorted[2]) & mask;
    for (; slots_[at] != kNone; at = (at + 1) & mask) {
      if (in_order(triangles[slots_[at]]) == sorted) return slots_[at];
    }
    return slots_[at] = face;
  }

 private:
  static Triangle in_order(Triangle triangle) {
    std::sort(triangle.begin(), triangle.end());
    return triangle;
  }

  std::vector<Index> slots_;
};

/// Finds the nearest of some points within a distance, by a grid of cubes of that size.
class NearIndex {
 public:
  explicit NearIndex(double distance) : distance_(distance) {}

  Index find_or_add(const std::vector<Vec3>& positions, Index vertex) {
    const Vec3& here = positions[vertex];
    if (!(here / distance_).allFinite()) return vertex;
    Index nearest = kNone;
    double least = distance_ * distance_;
    for_each_cell_around(here, [&](std::uint64_t cell) {
      const auto [first, last] = points_.equal_range(cell);
      for (auto point = first; point != last; ++point) {
        const double squared = (positions[point->second] - here).squaredNorm();
        if (squared > least || (squared == least && point->second > nearest)) continue;
        least = squared;
        nearest = point->second;
      }
    });
    if (nearest != kNone) return nearest;
    points_.emplace(cell_of(here, Vec3::Zero()), vertex);
    return vertex;
  }

 private:
  std::uint64_t cell_of(const Vec3& position, const Vec3& step) const {
    const auto number = [&](Eigen::Index axis) {
      return std::bit_cast<std::uint64_t>(std::floor(position[axis] / distance_) + step[axis] + 0.0);
    };
    return salted_hash(number(0), number(1), number(2));
  }

  template <typename Visit>
  void for_each_cell_around(const Vec3& position, Visit visit) const {
    for (int cell = 0; cell < 27; ++cell) {
      visit(cell_of(position, Vec3(cell % 3 - 1, cell / 3 % 3 - 1, cell / 9 - 1)));
    }
  }

  double distance_;
  std::unordered_multimap<std::uint64_t, Index> points_;
};

/// Per vertex, the first one that it is welded to: itself if it is the first.
std::vector<Index> first_vertices(const std::vector<Vec3>& positions, double tolerance, Tally& coincident) {
  std::vector<Index> first(positions.size());
  const auto find_all = [&](auto& index) {
    for (Index vertex = 0; vertex < first.size(); ++vertex) {
      first[vertex] = index.find_or_add(positions, vertex);
      if (first[vertex] != vertex) coincident.add(vertex);
    }
  };
  if (tolerance > 0) {
    NearIndex index(tolerance);
    find_all(index);
  } else {
    PositionIndex index;
    index.reserve(positions.size(), positions);
    find_all(index);
  }
  return first;
}

/// Per face, the first one with the same vertices, or kNone if the face is degenerate.
std::vector<Index> first_faces(const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles,
                               WeldFacts& facts) {
  TriangleIndex index(triangles.size());
  std::vector<Index> first(triangles.size(), kNone);
  for (Index face = 0; face < first.size(); ++face) {
    if (repeats_a_corner(triangles[face]) || !has_area(positions, triangles[face])) {
      facts.degenerate_faces.add(face);
      continue;
    }
    first[face] = index.find_or_add(triangles, face);
    if (first[face] != face) facts.duplicate_faces.add(face);
  }
  return first;
}

/// Numbers the elements that are their own first one, and lists them in `kept`.
std::vector<Index> renumbered(const std::vector<Index>& first, std::vector<Index>& kept) {
  std::vector<Index> number(first.size(), kNone);
  for (Index i = 0; i < first.size(); ++i) {
    if (first[i] == i) {
      number[i] = static_cast<Index>(kept.size());
      kept.push_back(i);
    } else if (first[i] != kNone) {
      number[i] = number[first[i]];
    }
  }
  return number;
}

/// Leaves out the vertices that no face which stays has: they would take part in the order and the means of a run.
void leave_out_unused(const std::vector<Triangle>& triangles, const std::vector<Index>& first_face,
                      std::vector<Index>& first_vertex) {
  std::vector<bool> used(first_vertex.size(), false);
  for (Index face = 0; face < first_face.size(); ++face) {
    if (first_face[face] != face) continue;
    for (const Index corner : triangles[face]) used[first_vertex[corner]] = true;
  }
  for (Index vertex = 0; vertex < first_vertex.size(); ++vertex) {
    if (first_vertex[vertex] == vertex && !used[vertex]) first_vertex[vertex] = kNone;
  }
}

Index edge_between(const Topology& topology, Index a, Index b) {
  if (a == kNone || b == kNone) return kNone;
  if (topology.vertex_edges[a].size() > topology.vertex_edges[b].size()) std::swap(a, b);
  for (const Index edge : topology.vertex_edges[a]) {
    if (other_end(topology.edges[edge], a) == b) return edge;
  }
  return kNone;
}

}  // namespace

std::optional<WeldedMesh> weld(const Mesh& upload, double tolerance, WeldFacts& facts) {
  facts = {};
  std::vector<Index> first_vertex = first_vertices(upload.positions, tolerance, facts.coincident_vertices);
  std::vector<Triangle> triangles;
  const bool welds = facts.coincident_vertices.count > 0;
  if (welds) {
    triangles = upload.triangles;
    for (Triangle& triangle : triangles) {
      for (Index& corner : triangle) corner = first_vertex[corner];
    }
  }
  std::vector<Index> first_face = first_faces(upload.positions, welds ? triangles : upload.triangles, facts);
  const bool keeps_all = facts.degenerate_faces.count == first_face.size();
  if (keeps_all) std::iota(first_face.begin(), first_face.end(), Index{0});
  const bool leaves_out = facts.degenerate_faces.count + facts.duplicate_faces.count > 0 && !keeps_all;
  if (!welds && !leaves_out) return std::nullopt;

  leave_out_unused(upload.triangles, first_face, first_vertex);
  WeldedMesh welded;
  welded.vertex_of = renumbered(first_vertex, welded.upload_vertex);
  welded.face_of = renumbered(first_face, welded.upload_face);
  for (const Index vertex : welded.upload_vertex) welded.mesh.positions.push_back(upload.positions[vertex]);
  for (const Index face : welded.upload_face) {
    Triangle triangle = upload.triangles[face];
    for (Index& corner : triangle) corner = welded.vertex_of[corner];
    welded.mesh.triangles.push_back(triangle);
  }
  welded.topology = build_topology(welded.mesh);
  return welded;
}

std::vector<Index> welded_edges(const Mesh& upload, const Topology& topology, const WeldedMesh& welded) {
  std::vector<Index> edges(topology.edges.size(), kNone);
  for (std::size_t face = 0; face < upload.triangles.size(); ++face) {
    const Index kept = welded.face_of[face];
    if (kept == kNone || welded.upload_face[kept] != face) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      if (topology.face_edges[face][k] == kNone) continue;
      edges[topology.face_edges[face][k]] = welded.topology.face_edges[kept][k];
    }
  }
  for (std::size_t e = 0; e < edges.size(); ++e) {
    if (edges[e] != kNone) continue;
    const auto [v0, v1] = topology.edges[e];
    edges[e] = edge_between(welded.topology, welded.vertex_of[v0], welded.vertex_of[v1]);
  }
  return edges;
}

}  // namespace crease
