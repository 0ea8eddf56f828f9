#include "core/smooth/coloring.h"

#include <algorithm>
#include <bit>

namespace crease {
namespace {

/// Sites of the same colour, in index order, colour after colour; kNone is no site.
Coloring group_by_color(const std::vector<Index>& colors, std::size_t color_count) {
  Coloring result;
  result.starts.assign(color_count + 1, 0);
  for (const Index color : colors) {
    if (color != kNone) ++result.starts[color + 1];
  }
  for (std::size_t color = 0; color < color_count; ++color) result.starts[color + 1] += result.starts[color];
  result.sites.resize(result.starts.back());
  std::vector<std::size_t> next(result.starts.begin(), result.starts.end() - 1);
  for (Index site = 0; site < colors.size(); ++site) {
    if (colors[site] != kNone) result.sites[next[colors[site]]++] = site;
  }
  return result;
}

Index opposite_vertex(const Triangle& triangle, const Edge& edge) {
  for (const Index v : triangle) {
    if (v != edge.v0 && v != edge.v1) return v;
  }
  return edge.v0;
}

/// Calls `visit` for the neighbours of `vertex`, some of them more than once.
template <typename Visit>
void visit_neighbors(const Mesh& mesh, const Topology& topology, Index vertex, Visit visit) {
  for (const Index face : topology.vertex_faces[vertex]) {
    for (const Index v : mesh.triangles[face]) visit(v);
    for (const Index edge : topology.face_edges[face]) {
      if (edge == kNone || !topology.is_interior(edge)) continue;
      for (const Index f : topology.edge_faces[edge]) visit(opposite_vertex(mesh.triangles[f], topology.edges[edge]));
    }
  }
}

}  // namespace

Coloring color_vertices(const Mesh& mesh, const Topology& topology) {
  std::vector<Index> colors(mesh.positions.size(), kNone);
  std::vector<Index> last_used_by;  // per colour: the vertex that last saw it on a neighbour
  for (Index vertex = 0; vertex < colors.size(); ++vertex) {
    if (topology.vertex_faces[vertex].empty()) continue;
    visit_neighbors(mesh, topology, vertex, [&](Index neighbor) {
      if (colors[neighbor] != kNone) last_used_by[colors[neighbor]] = vertex;
    });
    const auto free = std::ranges::find_if(last_used_by, [&](Index user) { return user != vertex; });
    colors[vertex] = static_cast<Index>(free - last_used_by.begin());
    if (free == last_used_by.end()) last_used_by.push_back(kNone);
  }
  return group_by_color(colors, last_used_by.size());
}

Coloring color_edges(const Topology& topology) {
  constexpr Index kColors = 64;
  std::vector<std::uint64_t> used(topology.vertex_edges.size(), 0);
  std::vector<Index> colors(topology.edges.size(), kNone);
  Index color_count = kColors;
  for (std::size_t e = 0; e < colors.size(); ++e) {
    if (!topology.is_interior(e)) continue;
    const auto [v0, v1] = topology.edges[e];
    const auto color = static_cast<Index>(std::countr_one(used[v0] | used[v1]));
    colors[e] = color < kColors ? color : color_count++;
    if (color < kColors) {
      used[v0] |= std::uint64_t{1} << color;
      used[v1] |= std::uint64_t{1} << color;
    }
  }
  return group_by_color(colors, color_count);
}

}  // namespace crease
