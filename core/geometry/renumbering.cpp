#include "core/geometry/renumbering.h"

#include <algorithm>
#include <cmath>
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
template <typename Key>
std::vector<Index> places_by(const std::vector<Key>& keys) {
  std::vector<std::pair<Key, Index>> order;
  order.reserve(keys.size());
  for (Index item = 0; item < keys.size(); ++item) order.emplace_back(keys[item], item);
  std::sort(order.begin(), order.end());
  std::vector<Index> places(keys.size());
  for (Index place = 0; place < order.size(); ++place) places[order[place].second] = place;
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
  new_face = places_by(first_vertex);
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

std::vector<Index> new_edges(const Renumbering& renumbering, const Topology& topology, const Topology& renumbered) {
  std::vector<Index> edges(topology.edges.size(), kNone);
  for (std::size_t f = 0; f < topology.face_edges.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index edge = topology.face_edges[f][k];
      if (edge != kNone) edges[edge] = renumbered.face_edges[renumbering.new_face[f]][k];
    }
  }
  return edges;
}

void adopt_orientation(const Topology& topology, const std::vector<Index>& new_face, const std::vector<Index>& new_edge,
                       Topology& renumbered) {
  for (std::size_t f = 0; f < new_face.size(); ++f) renumbered.flipped[new_face[f]] = topology.flipped[f];
  for (std::size_t e = 0; e < new_edge.size(); ++e) renumbered.edge_twisted[new_edge[e]] = topology.edge_twisted[e];
}

}  // namespace crease
