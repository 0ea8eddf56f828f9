#include "core/features/ridge_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>

#include "tests/support/labelled_meshes.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

using test::labelled;

std::vector<RidgeLine> lines_of(const LabelledMesh& result) {
  const Topology topology = build_topology(result.mesh);
  const auto classes = classify_vertices(topology, result.mesh.positions, result.labels);
  return trace_ridges(topology, result.mesh.positions, result.labels, result.dihedral_rad, classes);
}

std::vector<std::pair<Index, Index>> edges_of(const RidgeLine& line) {
  std::vector<std::pair<Index, Index>> edges;
  const std::size_t count = line.vertices.size();
  for (std::size_t i = 0; i + (line.closed ? 0 : 1) < count; ++i) {
    edges.emplace_back(std::minmax(line.vertices[i], line.vertices[(i + 1) % count]));
  }
  return edges;
}

TEST(RidgeLines, ACubeHasTwelveFromCornerToCorner) {
  const LabelledMesh cube = labelled(test::cube(4, 2.0));
  const std::vector<RidgeLine> lines = lines_of(cube);
  ASSERT_EQ(lines.size(), 12U);
  std::map<Index, int> lines_at;
  for (const RidgeLine& line : lines) {
    EXPECT_FALSE(line.closed);
    EXPECT_EQ(line.vertices.size(), 5U);
    EXPECT_LT(line.vertices.front(), line.vertices.back());
    EXPECT_NEAR(line.length, 2, 1e-12);
    EXPECT_NEAR(line.mean_label, 1, 1e-12);
    EXPECT_NEAR(line.mean_dihedral_rad, M_PI / 2, 1e-12);
    ++lines_at[line.vertices.front()];
    ++lines_at[line.vertices.back()];
  }
  EXPECT_EQ(lines_at.size(), 8U);
  for (const auto& [corner, count] : lines_at) EXPECT_EQ(count, 3);
}

TEST(RidgeLines, ACylinderHasTwoLoops) {
  const std::vector<RidgeLine> lines = lines_of(labelled(test::cylinder(24, 6, 1, 2)));
  ASSERT_EQ(lines.size(), 2U);
  for (const RidgeLine& line : lines) {
    EXPECT_TRUE(line.closed);
    EXPECT_EQ(line.vertices.size(), 24U);
    EXPECT_NEAR(line.length, 48 * std::sin(M_PI / 24), 1e-9);
    EXPECT_EQ(line.vertices.front(), *std::ranges::min_element(line.vertices));
    EXPECT_LT(line.vertices[1], line.vertices.back());
  }
}

TEST(RidgeLines, EveryRidgeEdgeIsInExactlyOneLineOfAnyMesh) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> anywhere(0, 1);
  for (const auto& member : test::mesh_family()) {
    SCOPED_TRACE(member.name);
    LabelledMesh result = labelled(member.mesh);
    const Topology topology = build_topology(member.mesh);
    for (int trial = 0; trial < 4; ++trial) {
      std::set<std::pair<Index, Index>> expected, found;
      std::size_t listed = 0;
      for (Index e = 0; e < result.labels.size(); ++e) {
        result.labels[e] = topology.is_interior(e) ? anywhere(random) : 0;
        if (result.labels[e] >= kRidgeThreshold) expected.emplace(result.edges[e].v0, result.edges[e].v1);
      }
      for (const RidgeLine& line : lines_of(result)) {
        for (const auto& edge : edges_of(line)) found.insert(edge);
        listed += edges_of(line).size();
        EXPECT_GE(line.mean_label, kRidgeThreshold);
      }
      EXPECT_EQ(found, expected);
      EXPECT_EQ(listed, expected.size());
    }
  }
}

TEST(RidgeLines, ALoopThroughOneCornerStartsThereAndIsClosed) {
  LabelledMesh result = labelled(test::icosphere(2));
  const Topology topology = build_topology(result.mesh);
  std::ranges::fill(result.labels, 0.0);
  for (const Index e : topology.face_edges[0]) result.labels[e] = 1;
  std::vector<VertexClass> classes(result.mesh.positions.size(), VertexClass::kRidge);
  for (const Index corner : result.mesh.triangles[0]) {
    std::ranges::fill(classes, VertexClass::kRidge);
    classes[corner] = VertexClass::kCorner;
    const auto lines = trace_ridges(topology, result.mesh.positions, result.labels, result.dihedral_rad, classes);
    ASSERT_EQ(lines.size(), 1U);
    EXPECT_TRUE(lines[0].closed);
    EXPECT_EQ(lines[0].vertices.size(), 3U);
    EXPECT_EQ(lines[0].vertices.front(), corner);
  }
  for (const Index corner : result.mesh.triangles[0]) classes[corner] = VertexClass::kCorner;
  EXPECT_EQ(trace_ridges(topology, result.mesh.positions, result.labels, result.dihedral_rad, classes).size(), 3U);
}

TEST(RidgeLines, ConcaveRidgesHaveNegativeAngles) {
  LabelledMesh result = labelled(test::cad_part(2).mesh);
  const std::vector<RidgeLine> lines = lines_of(result);
  EXPECT_TRUE(std::ranges::any_of(lines, [](const RidgeLine& line) { return line.mean_dihedral_rad < -1; }));
  EXPECT_TRUE(std::ranges::any_of(lines, [](const RidgeLine& line) { return line.mean_dihedral_rad > 1; }));
}

}  // namespace
}  // namespace crease
