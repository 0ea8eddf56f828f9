#include "core/choice/spikes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "core/base/quantile.h"
#include "core/choice/first_sight.h"

namespace crease {
namespace {

constexpr double kStillBent = 0.6;  ///< share of the bending
constexpr double kUnusual = 6;      ///< times the usual distance from the neighbours
constexpr double kMostSpikes = 0.02;

/// Of a vertex that has some.
Vec3 mean_of_neighbours(const Topology& topology, const std::vector<Vec3>& positions, Index vertex) {
  Vec3 sum = Vec3::Zero();
  for (const Index edge : topology.vertex_edges[vertex]) sum += positions[other_end(topology.edges[edge], vertex)];
  return sum / static_cast<double>(topology.vertex_edges[vertex].size());
}

/// A vertex in the middle of a closed ring of faces, and what the surface around it looks like from other places.
class Tip {
 public:
  Tip(const Mesh& mesh, const Topology& topology, Index vertex) : mesh_(mesh), topology_(topology), vertex_(vertex) {}

  /// Whether it is further than `height` from its neighbours, and what is said of spikes holds.
  bool is_spike(double height) const {
    return is_inside() && height > rim_length() &&
           bending(mean_of_neighbours(topology_, mesh_.positions, vertex_)) <
               kStillBent * bending(mesh_.positions[vertex_]);
  }

 private:
  std::span<const Index> spokes() const { return topology_.vertex_edges[vertex_]; }
  std::span<const Index> faces() const { return topology_.vertex_faces[vertex_]; }

  Index rim(Index face) const {
    const Triangle& corners = mesh_.triangles[face];
    const auto place = static_cast<std::size_t>(std::ranges::find(corners, vertex_) - corners.begin());
    return topology_.face_edges[face][(place + 1) % 3];
  }

  bool is_inside() const {
    constexpr std::size_t kFewest = 3;
    const auto is_interior = [&](Index edge) { return edge != kNone && topology_.is_interior(edge); };
    return faces().size() >= kFewest && spokes().size() == faces().size() &&
           std::ranges::all_of(spokes(), is_interior) &&
           std::ranges::all_of(faces(), [&](Index face) { return is_interior(rim(face)); });
  }

  double rim_length() const {
    double sum = 0;
    for (const Index face : faces()) {
      const Edge& edge = topology_.edges[rim(face)];
      sum += (mesh_.positions[edge.v0] - mesh_.positions[edge.v1]).norm();
    }
    return sum / static_cast<double>(faces().size());
  }

  /// Not of unit length. The vertex is at `place`.
  Vec3 normal(Index face, const Vec3& place) const {
    const Triangle corners = oriented(mesh_, topology_, face);
    const auto at = [&](Index corner) { return corner == vertex_ ? place : mesh_.positions[corner]; };
    return (at(corners[1]) - at(corners[0])).cross(at(corners[2]) - at(corners[0]));
  }

  /// The angle between the faces of an edge.
  double bend(Index edge, const Vec3& place) const {
    const auto& [first, second] = topology_.edge_faces[edge];
    const Vec3 a = normal(first, place), b = normal(second, place);
    return std::atan2(a.cross(b).norm(), a.dot(b));
  }

  /// Sum over the edges of the faces around the vertex.
  double bending(const Vec3& place) const {
    double sum = 0;
    for (const Index spoke : spokes()) sum += bend(spoke, place);
    for (const Index face : faces()) sum += bend(rim(face), place);
    return sum;
  }

  const Mesh& mesh_;
  const Topology& topology_;
  Index vertex_;
};

/// The distance of each vertex from the mean of its neighbours; 0 without any.
std::vector<double> heights_over_neighbours(const Mesh& mesh, const Topology& topology, ThreadTeam& team) {
  std::vector<double> heights(mesh.positions.size(), 0);
  for_each(heights.size(), team, [&](std::size_t v) {
    if (topology.vertex_edges[v].empty()) return;
    heights[v] = (mesh.positions[v] - mean_of_neighbours(topology, mesh.positions, static_cast<Index>(v))).norm();
  });
  return heights;
}

}  // namespace

std::vector<Index> find_spikes(const Mesh& mesh, const Topology& topology, ThreadTeam& team) {
  const std::vector<double> heights = heights_over_neighbours(mesh, topology, team);
  const double usual = quantile(heights, 0.5);
  std::vector<Index> spikes;
  for (Index v = 0; v < heights.size(); ++v) {
    if (heights[v] > kUnusual * usual && Tip(mesh, topology, v).is_spike(heights[v])) spikes.push_back(v);
  }
  if (static_cast<double>(spikes.size()) > kMostSpikes * static_cast<double>(mesh.positions.size())) spikes.clear();
  return spikes;
}

std::size_t flatten_spikes(Mesh& mesh, const Topology& topology, ThreadTeam& team) {
  constexpr double kNoNoise = 0.01;  // of ℓ
  const std::vector<Index> spikes = find_spikes(mesh, topology, team);
  if (spikes.empty()) return 0;
  Mesh flattened = mesh;
  for (const Index v : spikes) flattened.positions[v] = mean_of_neighbours(topology, flattened.positions, v);
  if (look_at(Surface(flattened, topology, team), std::nullopt, std::nullopt, team).sigma < kNoNoise) return 0;
  mesh = std::move(flattened);
  return spikes.size();
}

}  // namespace crease
