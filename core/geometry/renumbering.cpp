#include "core/geometry/renumbering.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace crease {
namespace {

constexpr int kBits = 20;

/// Spreads the low 20 bits three places apart.
std::uint64_t spread(std::uint64_t bits) {
  std::uint64_t result = 0;
  for (int i = 0; i < kBits; ++i) result |= ((bits >> i) & 1U) << (3 * i);
  return result;
}

/// Place on the Morton curve through the bounding box.
std::vector<std::uint64_t> morton_codes(const std::vector<Vec3>& positions) {
  Vec3 low = positions.front(), high = positions.front();
  for (const Vec3& position : positions) {
    low = low.cwiseMin(position);
    high = high.cwiseMax(position);
  }
  const double extent = (high - low).maxCoeff();
  const double scale = extent > 0 && std::isfinite(extent) ? ((1 << kBits) - 1) / extent : 0;
  std::vector<std::uint64_t> codes;
  codes.reserve(positions.size());
  for (const Vec3& position : positions) {
    const Vec3 cell = (position - low) * scale;
    codes.push_back(spread(static_cast<std::uint64_t>(cell.x())) | spread(static_cast<std::uint64_t>(cell.y())) << 1 |
                    spread(static_cast<std::uint64_t>(cell.z())) << 2);
  }
  return codes;
}

/// Where each item goes when they are put in the order of their keys; equal keys keep their order.
std::vector<Index> places_by(const std::vector<std::uint64_t>& keys) {
  std::vector<std::pair<std::uint64_t, Index>> order;
  order.reserve(keys.size());
  for (Index item = 0; item < keys.size(); ++item) order.emplace_back(keys[item], item);
  std::sort(order.begin(), order.end());
  std::vector<Index> places(keys.size());
  for (Index place = 0; place < order.size(); ++place) places[order[place].second] = place;
  return places;
}

/// The same for keys below `count`.
std::vector<Index> places_by(const std::vector<Index>& keys, std::size_t count) {
  std::vector<Index> next(count + 1, 0), places(keys.size());
  for (const Index key : keys) ++next[key + std::size_t{1}];
  std::partial_sum(next.begin(), next.end(), next.begin());
  for (std::size_t item = 0; item < keys.size(); ++item) places[item] = next[keys[item]]++;
  return places;
}

}  // namespace

Renumbering::Renumbering(const Mesh& given) {
  new_vertex = places_by(morton_codes(given.positions));
  mesh.positions.resize(given.positions.size());
  for (std::size_t v = 0; v < given.positions.size(); ++v) mesh.positions[new_vertex[v]] = given.positions[v];

  std::vector<Index> first_vertex;
  first_vertex.reserve(given.triangles.size());
  for (const auto& [a, b, c] : given.triangles) {
    first_vertex.push_back(std::min({new_vertex[a], new_vertex[b], new_vertex[c]}));
  }
  new_face = places_by(first_vertex, given.positions.size());
  mesh.triangles.resize(given.triangles.size());
  for (std::size_t f = 0; f < given.triangles.size(); ++f) {
    const auto& [a, b, c] = given.triangles[f];
    mesh.triangles[new_face[f]] = {new_vertex[a], new_vertex[b], new_vertex[c]};
  }
}

std::vector<double> Renumbering::renumbered(std::span<const double> values) const {
  std::vector<double> result(values.size());
  for (std::size_t v = 0; v < values.size(); ++v) result[new_vertex[v]] = values[v];
  return result;
}

RenumberedTopology::RenumberedTopology(const Renumbering& renumbering, const Topology& given)
    : new_edge(given.edges.size(), kNone) {
  const std::size_t faces = renumbering.new_face.size(), edges = given.edges.size();
  topology.edges.resize(edges);
  topology.edge_faces.assign(edges, {kNone, kNone});
  topology.edge_face_count.assign(edges, 0);
  topology.edge_twisted.resize(edges);
  topology.face_edges.resize(faces);
  topology.flipped.resize(faces);
  std::vector<Index> old_face(faces);
  for (Index f = 0; f < faces; ++f) old_face[renumbering.new_face[f]] = f;
  Index next = 0;
  for (Index f = 0; f < faces; ++f) {
    topology.flipped[f] = given.flipped[old_face[f]];
    for (std::size_t k = 0; k < 3; ++k) {
      const Index old = given.face_edges[old_face[f]][k];
      Index& edge = topology.face_edges[f][k];
      edge = old == kNone ? kNone : new_edge[old];
      if (old == kNone) continue;
      if (edge == kNone) {
        edge = new_edge[old] = next++;
        const auto [low, high] =
            std::minmax(renumbering.new_vertex[given.edges[old].v0], renumbering.new_vertex[given.edges[old].v1]);
        topology.edges[edge] = {low, high};
        topology.edge_twisted[edge] = given.edge_twisted[old];
      }
      const std::uint32_t seen = topology.edge_face_count[edge]++;
      if (seen < 2) topology.edge_faces[edge][seen] = f;
    }
  }
  list_by_vertex(renumbering.mesh, topology);
}

}  // namespace crease
