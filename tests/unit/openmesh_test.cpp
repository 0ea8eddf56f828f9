#include "core/mesh/openmesh.h"

#include <gtest/gtest.h>

#include <set>

#include "core/error.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

const std::set<std::string> kNotForHalfEdges = {"touching_tetrahedra", "finned_grid", "duplicate_faces",
                                                "repeated_corners",    "mobius",      "inconsistently_wound"};

TEST(OpenMesh, PositionsFacesAndOrderSurviveARoundTrip) {
  int held = 0;
  for (const auto& member : test::mesh_family()) {
    if (kNotForHalfEdges.contains(member.name)) continue;
    SCOPED_TRACE(member.name);
    const Mesh back = from_openmesh(to_openmesh(member.mesh));
    EXPECT_EQ(back.positions, member.mesh.positions);
    EXPECT_EQ(back.triangles, member.mesh.triangles);
    ++held;
  }
  EXPECT_GE(held, 10);
}

TEST(OpenMesh, ConnectivityMatchesTheTopology) {
  const Mesh mesh = test::cad_part(2).mesh;
  const HalfEdgeMesh half_edges = to_openmesh(mesh);
  const Topology topology = build_topology(mesh);
  EXPECT_EQ(half_edges.n_edges(), topology.edges.size());
  for (const auto vertex : half_edges.vertices()) {
    EXPECT_EQ(half_edges.valence(vertex), topology.vertex_edges[static_cast<std::size_t>(vertex.idx())].size());
  }
}

TEST(OpenMesh, RefusesWhatAHalfEdgeMeshCannotStoreAndNamesTheFace) {
  for (const auto& member : test::mesh_family()) {
    if (!kNotForHalfEdges.contains(member.name)) continue;
    SCOPED_TRACE(member.name);
    try {
      to_openmesh(member.mesh);
      FAIL() << "held";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), code::kMeshUnsupported);
      EXPECT_EQ(error.place().substr(0, 5), "face ");
    }
  }
}

TEST(OpenMesh, NamesTheFirstFaceThatDoesNotFit) {
  Mesh mesh = test::grid(3, 3);
  const std::size_t bad = 10;
  std::swap(mesh.triangles[bad][0], mesh.triangles[bad][1]);
  try {
    to_openmesh(mesh);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.place(), "face 10");
  }
}

TEST(OpenMesh, AMeshBuiltWithOpenMeshIsConverted) {
  HalfEdgeMesh half_edges;
  const auto a = half_edges.add_vertex({0, 0, 0}), b = half_edges.add_vertex({1, 0, 0});
  const auto c = half_edges.add_vertex({0, 1, 0}), d = half_edges.add_vertex({1, 1, 0.125});
  half_edges.add_face(a, b, c);
  half_edges.add_face(b, d, c);
  const Mesh mesh = from_openmesh(half_edges);
  EXPECT_EQ(mesh.positions[3], Vec3(1, 1, 0.125));
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}));
}

}  // namespace
}  // namespace crease
