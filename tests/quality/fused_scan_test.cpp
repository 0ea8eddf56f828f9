#include "tests/quality/fused_scan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/measure/measure.h"
#include "core/mesh/topology.h"
#include "tests/support/meshes.h"

namespace crease::quality {
namespace {

TEST(FusedScan, WithoutNoiseItIsTheModelInVoxels) {
  const FusedScan settings{.voxels_across = 40, .views = 30, .pixels_across = 160};
  const auto scan = take_fused_scan(test::icosphere(5), settings, 1);
  ASSERT_TRUE(scan);
  const Topology topology = build_topology(scan->noisy);
  for (std::size_t e = 0; e < topology.edges.size(); ++e) EXPECT_NE(topology.edge_faces[e][0], kNone);
  const double voxel = 1 / settings.voxels_across;
  double squares = 0, volume = 0;
  for (const Vec3& position : scan->noisy.positions) squares += std::pow(position.norm() - 0.5, 2);
  for (const Vec3& position : scan->original.positions) EXPECT_NEAR(position.norm(), 0.5, 0.05 * voxel);
  for (const auto& [a, b, c] : scan->noisy.triangles) {
    const auto& at = scan->noisy.positions;
    volume += at[a].dot(at[b].cross(at[c])) / 6;
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(scan->noisy.positions.size())), 0.15 * voxel);
  EXPECT_NEAR(volume, 4.0 / 3 * std::numbers::pi * 0.125, 0.02);  // all of it, and faces look outwards
}

TEST(FusedScan, VerticesLieOnTheEdgesOfVoxels) {
  const auto scan = take_fused_scan(test::icosphere(5), {.noise = {.level = 1, .fine_width = 1}}, 1);
  ASSERT_TRUE(scan);
  for (const Vec3& position : scan->noisy.positions) {
    int whole = 0;
    for (const double x : position) {
      const double twice = 2 * x * 50;  // corners lie at halves where their number is even
      whole += std::abs(twice - std::round(twice)) < 1e-6 ? 1 : 0;
    }
    EXPECT_GE(whole, 2);
  }
}

TEST(FusedScan, NoiseOfTheCamerasBecomesNoiseOfTheScan) {
  const auto error = [](double level) {
    const auto scan = take_fused_scan(test::icosphere(5), {.noise = {.level = level, .fine_width = 1}}, 1);
    return scan ? measure(scan->original, scan->noisy).mean_normal_error_deg : 0;
  };
  EXPECT_GT(error(1), 2 * error(0.2));
  EXPECT_GT(error(0.2), 0.5);
}

TEST(FusedScan, TheSameSeedGivesTheSameScan) {
  const FusedScan settings{.misplacement = 0.3, .noise = {.level = 0.5}};
  const Mesh model = test::cube(6);
  const auto one = take_fused_scan(model, settings, 7), same = take_fused_scan(model, settings, 7),
             other = take_fused_scan(model, settings, 8);
  ASSERT_TRUE(one && same && other);
  EXPECT_EQ(one->noisy.positions, same->noisy.positions);
  EXPECT_NE(one->noisy.positions, other->noisy.positions);
}

TEST(FusedScan, WhatIsTooSmallIsNoScan) { EXPECT_FALSE(take_fused_scan(test::cube(2), {.voxels_across = 6}, 1)); }

}  // namespace
}  // namespace crease::quality
