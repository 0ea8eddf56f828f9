#include "core/mesh/mesh_parts.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace crease {
namespace {

struct Component {
  std::size_t faces = 0, edges = 0;
  double length = 0;  ///< of all edges

  double mean_edge() const { return edges > 0 ? length / static_cast<double>(edges) : 0; }
};

std::vector<Component> sizes_of(const Components& components, const Mesh& mesh, const Topology& topology) {
  std::vector<Component> all(components.count);
  for (const Triangle& triangle : mesh.triangles) ++all[components.of_vertex[triangle[0]]].faces;
  for (const Edge& edge : topology.edges) {
    Component& component = all[components.of_vertex[edge.v0]];
    ++component.edges;
    component.length += (mesh.positions[edge.v0] - mesh.positions[edge.v1]).stableNorm();
  }
  return all;
}

/// By what factor, as a logarithm, edges are longer or shorter.
double unlikeness(const Component& a, const Component& b) { return std::abs(std::log(a.mean_edge() / b.mean_edge())); }

/// Those that make a part, the largest first.
std::vector<Index> heads_of(const std::vector<Component>& components, std::size_t faces_of_whole) {
  const std::size_t least = faces_of_whole > kFacesOfSeconds ? faces_of_whole / kMostPartsOfSeconds : 0;
  std::vector<Index> order(components.size()), heads;
  std::iota(order.begin(), order.end(), Index{0});
  std::ranges::stable_sort(order, std::ranges::greater(), [&](Index i) { return components[i].faces; });
  for (const Index i : order) {
    const Component& one = components[i];
    if (one.faces < std::max(least, kFewestFacesOfUnlikePart) || heads.size() == kMostParts) break;
    if (!(one.mean_edge() > 0)) continue;
    const bool is_like_none = std::ranges::all_of(
        heads, [&](Index head) { return unlikeness(one, components[head]) > std::log(kUnlikeEdges); });
    if (one.faces >= kFewestFacesOfPart || is_like_none) heads.push_back(i);
  }
  return heads;
}

/// Per component: its part.
std::vector<Index> parts_of_components(const std::vector<Component>& components, const std::vector<Index>& heads) {
  std::vector<Index> parts(components.size());
  for (std::size_t i = 0; i < components.size(); ++i) {
    const auto of_head = [&](Index head) { return head == i ? -1 : unlikeness(components[i], components[head]); };
    parts[i] = static_cast<Index>(std::ranges::min_element(heads, {}, of_head) - heads.begin());
  }
  return parts;
}

}  // namespace

std::vector<MeshPart> parts_of(const Mesh& mesh, const Topology& topology) {
  if (mesh.triangles.size() < 2 * kFewestFacesOfUnlikePart) return {};
  const Components components = find_components(mesh);
  if (components.count < 2) return {};
  const std::vector<Component> all = sizes_of(components, mesh, topology);
  const std::vector<Index> heads = heads_of(all, mesh.triangles.size());
  if (heads.size() < 2) return {};
  const std::vector<Index> part_of_component = parts_of_components(all, heads);
  const auto part_of = [&](Index vertex) {
    const Index component = components.of_vertex[vertex];
    return component == kNone ? Index{0} : part_of_component[component];
  };
  std::vector<MeshPart> parts(heads.size());
  std::vector<Index> number(mesh.positions.size());  // in its part
  for (Index v = 0; v < number.size(); ++v) {
    MeshPart& part = parts[part_of(v)];
    number[v] = static_cast<Index>(part.vertices.size());
    part.vertices.push_back(v);
    part.mesh.positions.push_back(mesh.positions[v]);
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    parts[part_of(a)].mesh.triangles.push_back({number[a], number[b], number[c]});
  }
  for (Index e = 0; e < topology.edges.size(); ++e) parts[part_of(topology.edges[e].v0)].edges.push_back(e);
  return parts;
}

}  // namespace crease
