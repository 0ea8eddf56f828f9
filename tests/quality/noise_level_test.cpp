#include "core/choice/noise_level.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/choice/first_sight.h"
#include "core/choice/noise_direction.h"
#include "core/measure/noise.h"
#include "tests/quality/noise_models.h"
#include "tests/support/meshes.h"

namespace crease::quality {
namespace {

NoiseLevel level_of(const Mesh& mesh) {
  const Topology topology = build_topology(mesh);
  return estimate_noise_level(Surface(mesh, topology), calling_thread());
}

TEST(NoiseLevel, ImpulsesThatAreFewStandOutAlone) {
  for (const Mesh& original : {test::icosphere(5), test::cad_part(4).mesh}) {
    const LoneImpulses impulses = level_of(add_noise_of_kind(original, Noise::kSparse, 0.5, 1)).impulses;
    EXPECT_GT(impulses.share, 0.01);
    EXPECT_NEAR(impulses.rms, 0.5, 0.2);
  }
}

TEST(NoiseLevel, NeitherShapesNorGaussianNoiseHaveLoneImpulses) {
  for (const Mesh& original :
       {test::icosphere(5), test::cad_part(4).mesh, test::cube(8), test::cylinder(24, 8, 1, 3)}) {
    EXPECT_LT(level_of(original).impulses.share, 0.002);
    for (const double level : {0.05, 0.2, 0.5}) {
      for (const NoiseKind kind : {NoiseKind::kNormal, NoiseKind::kGaussian}) {
        EXPECT_LT(level_of(add_noise(original, level, 1, kind)).impulses.share, 0.004) << level;
      }
    }
  }
}

TEST(NoiseLevel, OnlyImpulsesTellOfThemselves) {
  const auto sight_of = [](const Mesh& mesh) {
    const Topology topology = build_topology(mesh);
    return look_at(Surface(mesh, topology), std::nullopt, std::nullopt, calling_thread());
  };
  EXPECT_TRUE(sight_of(add_noise_of_kind(test::icosphere(5), Noise::kSparse, 0.5, 1)).impulses_tell_sigma);
  for (const Mesh& mesh : {test::cube(1), test::cube(8), test::grid(12, 12)}) {
    EXPECT_FALSE(sight_of(mesh).impulses_tell_sigma);
  }
}

NoiseDirection direction_seen(const Mesh& mesh) {
  const Topology topology = build_topology(mesh);
  return look_at(Surface(mesh, topology), std::nullopt, std::nullopt, calling_thread()).direction;
}

TEST(NoiseDirection, IsSeenOfNoiseThatFoldsNoFaces) {
  for (const Mesh& original :
       {test::icosphere(5), test::cad_part(8).mesh, test::cube(16), test::cylinder(48, 24, 1, 3)}) {
    for (const double level : {0.1, 0.2, 0.3}) {
      SCOPED_TRACE(testing::Message() << original.triangles.size() << " faces, noise of " << level);
      EXPECT_EQ(direction_seen(add_noise(original, level, 1, NoiseKind::kNormal)), NoiseDirection::kNormal);
      EXPECT_EQ(direction_seen(add_noise(original, level, 1, NoiseKind::kGaussian)), NoiseDirection::kIsotropic);
    }
  }
}

/// Vertices that leave the lattice within a flat square, and then along its normal.
TEST(NoiseDirection, IrregularSamplingIsNoNoiseInAllDirections) {
  Mesh square = test::grid(40, 40);
  const Mesh moved = add_noise(square, 0.15, 1, NoiseKind::kGaussian);
  for (std::size_t v = 0; v < square.positions.size(); ++v) {
    square.positions[v].head<2>() = moved.positions[v].head<2>();
  }
  EXPECT_NE(direction_seen(add_noise(square, 0.4, 2, NoiseKind::kNormal)), NoiseDirection::kIsotropic);
}

TEST(NoiseDirection, ThinFacesThatFoldAreFreeToOpen) {
  NoiseLevel level;
  level.within = {.sigma = 0.8, .quantiles = {0.01, 0.07, 1.4, 1.5}, .alikeness = 0};
  EXPECT_EQ(seen_direction(level, 0.2), NoiseDirection::kNormal);
  level.folded_share = 0.25;
  EXPECT_EQ(seen_direction(level, 0.2), NoiseDirection::kUnsure);
  level.within.sigma = 0.05;  // strong noise along the normals of a regular mesh folds faces, too
  EXPECT_EQ(seen_direction(level, 0.6), NoiseDirection::kNormal);
}

TEST(NoiseLevel, VerticesOfARegularMeshWithNoiseAreBesideTheMeansOfTheirNeighboursByChance) {
  const WithinSurface within = level_of(add_noise(test::grid(60, 60), 0.1, 1, NoiseKind::kGaussian)).within;
  // Of six neighbours, two are those of the other end, too: (−1/6 − 1/6 + 2/36) / (1 + 1/6).
  EXPECT_NEAR(within.alikeness, -0.238, 0.02);
  EXPECT_NEAR(within.sigma, 0.1, 0.01);
  for (std::size_t k = 0; k < WithinSurface::kShares.size(); ++k) {  // squares of two Gaussians are exponential
    EXPECT_NEAR(within.quantiles[k] / (std::log(1 - WithinSurface::kShares[k]) / std::log(0.5)), 1, 0.15);
  }
}

TEST(NoiseLevel, IsotropicNoiseLooksGaussianWithinTheSurface) {
  const Mesh noisy = add_noise(test::icosphere(5), 0.3, 1, NoiseKind::kGaussian);
  const NoiseLevel level = level_of(noisy);
  EXPECT_NEAR(level.within.tail(), std::log(10) / std::log(2), 0.4);  // squares of two Gaussians are exponential
}

}  // namespace
}  // namespace crease::quality
