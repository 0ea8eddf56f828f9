#include "core/geometry/renumbering.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace crease {
namespace {

constexpr int kBits = 20;

/// Spreads the low 20 bits three places apart: 10 and 10, then 5 and 5 and so on.
std::uint64_t spread(std::uint64_t bits) {
  bits = (bits | bits << 32) & 0x001f00000000ffffU;
  bits = (bits | bits << 16) & 0x001f0000ff0000ffU;
  bits = (bits | bits << 8) & 0x100f00f00f00f00fU;
  bits = (bits | bits << 4) & 0x10c30c30c30c30c3U;
  return (bits | bits << 2) & 0x1249249249249249U;
}

/// Place on the Morton curve through the bounding box.
std::vector<std::uint64_t> morton_codes(const std::vector<Vec3>& positions, ThreadTeam& team) {
  Vec3 low = positions.front(), high = positions.front();
  for (const Vec3& position : positions) {
    low = low.cwiseMin(position);
    high = high.cwiseMax(position);
  }
  const double extent = (high - low).maxCoeff();
  const double scale = extent > 0 && std::isfinite(extent) ? ((1 << kBits) - 1) / extent : 0;
  std::vector<std::uint64_t> codes(positions.size());
  for_each(codes.size(), team, [&](std::size_t v) {
    const Vec3 cell = (positions[v] - low) * scale;
    codes[v] = spread(static_cast<std::uint64_t>(cell.x())) | spread(static_cast<std::uint64_t>(cell.y())) << 1 |
               spread(static_cast<std::uint64_t>(cell.z())) << 2;
  });
  return codes;
}

/// Where each item goes when they are put in the order of their keys; equal keys keep their order.
std::vector<Index> places_by(const std::vector<std::uint64_t>& keys, ThreadTeam& team) {
  std::vector<std::pair<std::uint64_t, Index>> order(keys.size());
  const auto middle = order.begin() + static_cast<std::ptrdiff_t>(order.size() / 2);
  const auto sort_part = [&](auto begin, auto end) {
    for (auto entry = begin; entry != end; ++entry) {
      const auto item = static_cast<Index>(entry - order.begin());
      *entry = {keys[item], item};
    }
    std::sort(begin, end);
  };
  run_together(
      team, [&] { sort_part(order.begin(), middle); }, [&] { sort_part(middle, order.end()); });
  std::inplace_merge(order.begin(), middle, order.end());
  std::vector<Index> places(keys.size());
  for_each(order.size(), team, [&](std::size_t place) { places[order[place].second] = static_cast<Index>(place); });
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

Renumbering::Renumbering(const Mesh& given, ThreadTeam& team) {
  new_vertex = places_by(morton_codes(given.positions, team), team);
  mesh.positions.resize(given.positions.size());
  for_each(given.positions.size(), team, [&](std::size_t v) { mesh.positions[new_vertex[v]] = given.positions[v]; });

  std::vector<Index> first_vertex(given.triangles.size());
  for_each(first_vertex.size(), team, [&](std::size_t f) {
    const auto& [a, b, c] = given.triangles[f];
    first_vertex[f] = std::min({new_vertex[a], new_vertex[b], new_vertex[c]});
  });
  new_face = places_by(first_vertex, given.positions.size());
  mesh.triangles.resize(given.triangles.size());
  for_each(given.triangles.size(), team, [&](std::size_t f) {
    const auto& [a, b, c] = given.triangles[f];
    mesh.triangles[new_face[f]] = {new_vertex[a], new_vertex[b], new_vertex[c]};
  });
}

std::vector<double> Renumbering::renumbered(std::span<const double> values) const {
  std::vector<double> result(values.size());
  for (std::size_t v = 0; v < values.size(); ++v) result[new_vertex[v]] = values[v];
  return result;
}

RenumberedTopology::RenumberedTopology(const Renumbering& renumbering, const Topology& given, ThreadTeam& team)
    : new_edge(given.edges.size(), kNone) {
  const std::size_t faces = renumbering.new_face.size(), edges = given.edges.size();
  topology.edges.resize(edges);
  topology.edge_faces.assign(edges, {kNone, kNone});
  topology.edge_face_count.assign(edges, 0);
  topology.edge_twisted.resize(edges);
  topology.face_edges.resize(faces);
  topology.flipped.resize(faces);
  for_each(faces, team, [&](std::size_t old) {
    const Index f = renumbering.new_face[old];
    topology.flipped[f] = given.flipped[old];
    topology.face_edges[f] = given.face_edges[old];  // numbered below
  });
  Index next = 0;
  for (Index f = 0; f < faces; ++f) {
    for (Index& edge : topology.face_edges[f]) {
      if (edge == kNone) continue;
      Index& number = new_edge[edge];
      if (number == kNone) number = next++;
      edge = number;
      const std::uint32_t seen = topology.edge_face_count[edge]++;
      if (seen < 2) topology.edge_faces[edge][seen] = f;
    }
  }
  for_each(edges, team, [&](std::size_t old) {
    const auto [low, high] =
        std::minmax(renumbering.new_vertex[given.edges[old].v0], renumbering.new_vertex[given.edges[old].v1]);
    topology.edges[new_edge[old]] = {low, high};
    topology.edge_twisted[new_edge[old]] = given.edge_twisted[old];
  });
  list_by_vertex(renumbering.mesh, topology, team);
}

}  // namespace crease
