#include "core/measure/samples.h"

#include <gtest/gtest.h>

#include "core/mesh/topology.h"

namespace crease {
namespace {

class Samples : public testing::TestWithParam<Mesh (*)()> {};

double signed_volume(const Mesh& mesh) {
  double six_volumes = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    six_volumes += mesh.positions[a].dot(mesh.positions[b].cross(mesh.positions[c]));
  }
  return six_volumes / 6;
}

TEST_P(Samples, AreClosedInOnePieceAndWoundOutward) {
  const Mesh mesh = GetParam()();
  const Topology topology = build_topology(mesh);
  for (std::size_t edge = 0; edge < topology.edges.size(); ++edge) EXPECT_TRUE(topology.is_interior(edge));
  EXPECT_EQ(find_components(mesh).count, 1U);
  EXPECT_GT(signed_volume(mesh), 0);
  for (const auto flipped : topology.flipped) EXPECT_EQ(flipped, 0);
}

TEST_P(Samples, AreTheSameAtEveryCall) { EXPECT_EQ(GetParam()().positions, GetParam()().positions); }

INSTANTIATE_TEST_SUITE_P(Meshes, Samples, testing::Values(&sample_part, &sample_scan));

}  // namespace
}  // namespace crease
