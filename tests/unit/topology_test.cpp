#include "core/mesh/topology.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numbers>
#include <set>

#include "tests/support/meshes.h"

namespace crease {
namespace {

using test::mesh_family;

TEST(Topology, EdgesAreThePairsOfDistinctCornersInOrderOfAppearance) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : mesh_family()) {
    std::vector<Edge> expected;
    std::map<std::pair<Index, Index>, std::uint32_t> count;
    for (const Triangle& t : mesh.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
        if (low != high && count[{low, high}]++ == 0) expected.push_back({low, high});
      }
    }
    const Topology topology = build_topology(mesh);
    ASSERT_EQ(topology.edges, expected) << name;
    for (std::size_t e = 0; e < expected.size(); ++e) {
      EXPECT_EQ(topology.edge_face_count[e], (count[{expected[e].v0, expected[e].v1}])) << name;
    }
  }
}

TEST(Topology, FacesEdgesAndVerticesReferToEachOther) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : mesh_family()) {
    const Topology topology = build_topology(mesh);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      for (const Index e : topology.vertex_edges[v]) {
        EXPECT_TRUE(topology.edges[e].v0 == v || topology.edges[e].v1 == v) << name;
      }
      for (const Index f : topology.vertex_faces[v])
        EXPECT_EQ(std::ranges::count(mesh.triangles[f], v) > 0, true) << name;
    }
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [low, high] = std::minmax(mesh.triangles[f][k], mesh.triangles[f][(k + 1) % 3]);
        const Index e = topology.face_edges[f][k];
        if (low == high) {
          EXPECT_EQ(e, kNone) << name;
        } else {
          EXPECT_EQ(topology.edges[e], (Edge{low, high})) << name;
        }
      }
    }
  }
}

TEST(Topology, TurnedFacesOfInteriorEdgesRunAgainstEachOther) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : mesh_family()) {
    const Topology topology = build_topology(mesh);
    const auto runs_forward = [&, &m = mesh](Index face, const Edge& edge) {
      const Triangle t = oriented(m, topology, face);
      for (std::size_t k = 0; k < 3; ++k) {
        if (t[k] == edge.v0 && t[(k + 1) % 3] == edge.v1) return true;
      }
      return false;
    };
    for (std::size_t e = 0; e < topology.edges.size(); ++e) {
      if (!topology.is_interior(e)) continue;
      const auto [f0, f1] = topology.edge_faces[e];
      EXPECT_NE(runs_forward(f0, topology.edges[e]), runs_forward(f1, topology.edges[e])) << name << " edge " << e;
    }
  }
}

TEST(Topology, TurnsTheMinorityOfFaces) {
  Mesh mesh = test::icosphere(1);
  for (const std::size_t f : {3U, 17U, 40U}) std::swap(mesh.triangles[f][0], mesh.triangles[f][1]);
  const Topology topology = build_topology(mesh);
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    EXPECT_EQ(topology.flipped[f] != 0, f == 3 || f == 17 || f == 40) << f;
  }
}

TEST(Topology, AMoebiusStripHasATwistedEdge) {
  const Topology topology = build_topology(test::mobius(12));
  EXPECT_GE(std::ranges::count(topology.edge_twisted, 1), 1);
}

TEST(Topology, ACubeHasTwelveConvexRidgesOfNinetyDegrees) {
  const Mesh mesh = test::cube(3);
  const Topology topology = build_topology(mesh);
  std::size_t ridges = 0;
  for (const double angle : signed_dihedral_angles(mesh, topology, mesh.positions)) {
    if (std::abs(angle) < 1e-12) continue;
    EXPECT_NEAR(angle, std::numbers::pi / 2, 1e-12);
    ++ridges;
  }
  EXPECT_EQ(ridges, 12U * 3U);
}

TEST(Topology, ACubeTurnedInsideOutIsConcave) {
  Mesh mesh = test::cube(2);
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  const std::vector<double> angles = signed_dihedral_angles(mesh, build_topology(mesh), mesh.positions);
  EXPECT_NEAR(*std::ranges::min_element(angles), -std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(*std::ranges::max_element(angles), 0, 1e-12);
}

TEST(Topology, CountsComponentsBySharedVertices) {
  Mesh two = test::joined({test::cube(1), test::icosphere(1)});
  two.positions.emplace_back(9, 9, 9);
  const Components components = find_components(two);
  EXPECT_EQ(components.count, 2U);
  EXPECT_EQ(components.of_vertex.front(), 0U);
  EXPECT_EQ(components.of_vertex[two.positions.size() - 2], 1U);
  EXPECT_EQ(components.of_vertex.back(), kNone);
}

TEST(Topology, MeanEdgeLengthOfAUnitCubeAveragesSidesAndDiagonals) {
  const Mesh mesh = test::cube(1);
  const Topology topology = build_topology(mesh);
  EXPECT_NEAR(mean_edge_length(mesh.positions, topology.edges), (12 + 6 * std::numbers::sqrt2) / 18, 1e-12);
}

// The cost for a vertex with very many faces must not be quadratic.
TEST(Topology, AHubOfManyFacesIsHandled) {
  constexpr Index kSpokes = 200'000;
  Mesh mesh;
  mesh.positions.emplace_back(0, 0, 1);
  for (Index i = 0; i < kSpokes; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSpokes;
    mesh.positions.emplace_back(std::cos(angle), std::sin(angle), 0);
    mesh.triangles.push_back({0, 1 + i, 1 + (i + 1) % kSpokes});
  }
  const Topology topology = build_topology(mesh);
  EXPECT_EQ(topology.edges.size(), 2U * kSpokes);
  EXPECT_EQ(topology.vertex_faces[0].size(), kSpokes);
}

}  // namespace
}  // namespace crease
