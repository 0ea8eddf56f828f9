#include "core/io/write_gltf_corners.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <tuple>

#include "core/mesh/face_vectors.h"

namespace crease {
namespace {

/// A corner of a face as seen from its vertex.
struct Corner {
  std::size_t face;
  std::size_t place;  ///< 0, 1 or 2
  Index next, previous;
};

/// An edge of a face, seen from the current vertex.
struct Spoke {
  Index to;
  std::size_t corner;
  bool outgoing;
};

/// The corners of all faces, vertex by vertex, in the order of the faces.
class CornerRows {
 public:
  explicit CornerRows(const Mesh& mesh) : mesh_(mesh), starts_(mesh.positions.size() + 1, 0) {
    for (const Triangle& triangle : mesh.triangles) {
      for (const Index vertex : triangle) ++starts_[vertex + 1];
    }
    std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
    places_.resize(3 * mesh.triangles.size());
    std::vector<std::size_t> next(starts_.begin(), starts_.end() - 1);
    for (std::size_t i = 0; i < places_.size(); ++i) places_[next[mesh.triangles[i / 3][i % 3]]++] = i;
  }

  void read(std::size_t vertex, std::vector<Corner>& corners) const {
    corners.clear();
    for (std::size_t i = starts_[vertex]; i < starts_[vertex + 1]; ++i) {
      const std::size_t face = places_[i] / 3, place = places_[i] % 3;
      const Triangle& triangle = mesh_.triangles[face];
      corners.push_back({face, place, triangle[(place + 1) % 3], triangle[(place + 2) % 3]});
    }
  }

 private:
  const Mesh& mesh_;
  std::vector<std::size_t> starts_;
  std::vector<std::size_t> places_;
};

/// For each vertex, the other ends of its ridges in ascending order.
IndexRows ridge_ends(const LabelledMesh& result) {
  IndexRows rows;
  rows.starts.assign(result.mesh.positions.size() + 1, 0);
  const auto for_each_end = [&](auto visit) {
    for (std::size_t edge = 0; edge < result.edges.size(); ++edge) {
      if (!is_ridge(result.labels[edge])) continue;
      visit(result.edges[edge].v0, result.edges[edge].v1);
      visit(result.edges[edge].v1, result.edges[edge].v0);
    }
  };
  for_each_end([&](Index from, Index) { ++rows.starts[from + 1]; });
  std::partial_sum(rows.starts.begin(), rows.starts.end(), rows.starts.begin());
  rows.items.resize(rows.starts.back());
  std::vector<Index> next(rows.starts.begin(), rows.starts.end() - 1);
  for_each_end([&](Index from, Index to) { rows.items[next[from]++] = to; });
  for (std::size_t row = 0; row < rows.size(); ++row) {
    std::sort(rows.items.begin() + rows.starts[row], rows.items.begin() + rows.starts[row + 1]);
  }
  return rows;
}

/// Joins corners into fans by union-find over spokes, sorted by their far end. The time is nearly linear in the valence
/// of the vertex.
class FanFinder {
 public:
  /// Returns the fan of each corner, named by its first corner. `ridges` are in ascending order. With `segments` of the
  /// faces, fans end between segments too.
  const std::vector<std::size_t>& find(Index vertex, const std::vector<Corner>& corners, std::span<const Index> ridges,
                                       std::span<const Index> segments) {
    fans_.resize(corners.size());
    std::iota(fans_.begin(), fans_.end(), std::size_t{0});
    spokes_.clear();
    for (std::size_t corner = 0; corner < corners.size(); ++corner) {
      if (corners[corner].next != vertex) spokes_.push_back({corners[corner].next, corner, true});
      if (corners[corner].previous != vertex) spokes_.push_back({corners[corner].previous, corner, false});
    }
    std::sort(spokes_.begin(), spokes_.end(), [](const Spoke& a, const Spoke& b) {
      return std::tie(a.to, a.corner, a.outgoing) < std::tie(b.to, b.corner, b.outgoing);
    });
    for (auto first = spokes_.begin(); first != spokes_.end();) {
      const auto last = std::find_if(first, spokes_.end(), [&](const Spoke& spoke) { return spoke.to != first->to; });
      const bool joins = last - first == 2 && first->outgoing != (first + 1)->outgoing;
      const auto segment = [&](const Spoke& spoke) { return segments[corners[spoke.corner].face]; };
      const bool parts = joins && !segments.empty() && segment(*first) != segment(*(first + 1));
      if (joins && !parts && !std::binary_search(ridges.begin(), ridges.end(), first->to)) {
        const std::size_t a = root(first->corner), b = root((first + 1)->corner);
        fans_[std::max(a, b)] = std::min(a, b);
      }
      first = last;
    }
    for (std::size_t corner = 0; corner < fans_.size(); ++corner) fans_[corner] = root(corner);
    return fans_;
  }

 private:
  std::size_t root(std::size_t corner) {
    while (fans_[corner] != corner) corner = fans_[corner] = fans_[fans_[corner]];
    return corner;
  }

  std::vector<std::size_t> fans_;
  std::vector<Spoke> spokes_;
};

std::vector<Vec3> area_vectors(const Mesh& mesh) {
  std::vector<Vec3> vectors;
  vectors.reserve(mesh.triangles.size());
  for (const Triangle& face : mesh.triangles) vectors.push_back(area_vector(mesh.positions, face));
  return vectors;
}

/// The direction of `sum`, or up if no face has an area.
Vec3 unit_or_up(const Vec3& sum) {
  const Vec3 unit = sum.stableNormalized();
  return unit.allFinite() && !unit.isZero(0.5) ? unit : Vec3::UnitZ();
}

}  // namespace

SplitMesh split_along_ridges(const LabelledMesh& result) {
  const Mesh& mesh = result.mesh;
  const std::vector<Vec3> areas = area_vectors(mesh);
  const IndexRows ridges = ridge_ends(result);
  const CornerRows rows(mesh);

  SplitMesh split;
  split.triangles = mesh.triangles;
  split.source.resize(mesh.positions.size());
  std::iota(split.source.begin(), split.source.end(), Index{0});
  split.normals.assign(mesh.positions.size(), Vec3::Zero());

  std::vector<Corner> corners;
  std::vector<Index> vertex_of_part;
  std::vector<Vec3> fan_areas;
  FanFinder fan_finder, part_finder;
  for (Index vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    rows.read(vertex, corners);
    const std::vector<std::size_t>& fans = fan_finder.find(vertex, corners, ridges[vertex], {});
    const std::vector<std::size_t>& parts =
        result.segments.empty() ? fans : part_finder.find(vertex, corners, ridges[vertex], result.segments);
    fan_areas.assign(corners.size(), Vec3::Zero());
    for (std::size_t i = 0; i < corners.size(); ++i) fan_areas[fans[i]] += areas[corners[i].face];
    vertex_of_part.assign(corners.size(), kNone);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      Index& part_vertex = vertex_of_part[parts[i]];
      if (part_vertex == kNone && i == 0) part_vertex = vertex;
      if (part_vertex == kNone) {
        part_vertex = static_cast<Index>(split.source.size());
        split.source.push_back(vertex);
        split.normals.emplace_back(Vec3::Zero());
      }
      split.triangles[corners[i].face][corners[i].place] = part_vertex;
      split.normals[part_vertex] = fan_areas[fans[i]];
    }
  }
  for (Vec3& normal : split.normals) normal = unit_or_up(normal);
  return split;
}

}  // namespace crease
