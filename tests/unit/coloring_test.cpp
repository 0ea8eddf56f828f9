#include "core/smooth/coloring.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <set>

#include "tests/support/meshes.h"

namespace crease {
namespace {

using test::mesh_family;

std::vector<Index> group_of(const Coloring& coloring, std::size_t sites) {
  std::vector<Index> groups(sites, kNone);
  for (std::size_t g = 0; g < coloring.groups(); ++g) {
    for (std::size_t i = coloring.starts[g]; i < coloring.starts[g + 1]; ++i) {
      EXPECT_EQ(groups[coloring.sites[i]], kNone) << "a site in two groups";
      groups[coloring.sites[i]] = static_cast<Index>(g);
    }
  }
  return groups;
}

TEST(Coloring, VerticesOfAdjacentFacesDifferAndAllVerticesOfFacesAreThere) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : mesh_family()) {
    const Topology topology = build_topology(mesh);
    const std::vector<Index> groups = group_of(color_vertices(mesh, topology), mesh.positions.size());
    for (std::size_t v = 0; v < groups.size(); ++v)
      EXPECT_EQ(groups[v] == kNone, topology.vertex_faces[v].empty()) << name;
    const auto expect_different = [&, &label = name](Index a, Index b) {
      if (a != b) EXPECT_NE(groups[a], groups[b]) << label;
    };
    for (const auto& [a, b, c] : mesh.triangles) {
      expect_different(a, b);
      expect_different(b, c);
      expect_different(c, a);
    }
    for (std::size_t e = 0; e < topology.edges.size(); ++e) {
      if (!topology.is_interior(e)) continue;
      for (const Index a : mesh.triangles[topology.edge_faces[e][0]]) {
        for (const Index b : mesh.triangles[topology.edge_faces[e][1]]) expect_different(a, b);
      }
    }
  }
}

TEST(Coloring, InteriorEdgesThatShareAVertexDiffer) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : mesh_family()) {
    const Topology topology = build_topology(mesh);
    const std::vector<Index> groups = group_of(color_edges(topology), topology.edges.size());
    for (std::size_t e = 0; e < groups.size(); ++e) EXPECT_EQ(groups[e] != kNone, topology.is_interior(e)) << name;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      std::set<Index> seen;
      for (const Index e : topology.vertex_edges[v]) {
        if (groups[e] != kNone) EXPECT_TRUE(seen.insert(groups[e]).second) << name;
      }
    }
  }
}

TEST(Coloring, AHubHasOneEdgeInEachGroup) {
  constexpr Index kSpokes = 1000;
  Mesh mesh;
  mesh.positions.emplace_back(0, 0, 1);
  for (Index i = 0; i < kSpokes; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSpokes;
    mesh.positions.emplace_back(std::cos(angle), std::sin(angle), 0);
    mesh.triangles.push_back({0, 1 + i, 1 + (i + 1) % kSpokes});
  }
  const Topology topology = build_topology(mesh);
  const std::vector<Index> groups = group_of(color_edges(topology), topology.edges.size());
  std::set<Index> at_hub;
  for (const Index e : topology.vertex_edges[0]) at_hub.insert(groups[e]);
  EXPECT_EQ(at_hub.size(), kSpokes);
}

}  // namespace
}  // namespace crease
