#include "core/choice/noise_level.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/choice/first_sight.h"
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

TEST(NoiseLevel, IsotropicNoiseLooksGaussianWithinTheSurface) {
  const Mesh noisy = add_noise(test::icosphere(5), 0.3, 1, NoiseKind::kGaussian);
  const NoiseLevel level = level_of(noisy);
  EXPECT_NEAR(level.tangential_tail, std::log(10) / std::log(2), 0.4);  // squares of two Gaussians are exponential
}

}  // namespace
}  // namespace crease::quality
