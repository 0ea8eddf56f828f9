#include "core/choice/noise_level.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/measure/noise.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

NoiseLevel level_of(const Mesh& mesh) {
  const Topology topology = build_topology(mesh);
  return estimate_noise_level(Surface(mesh, topology), calling_thread());
}

/// Gaussian noise along the normals, on a tenth of the vertices.
Mesh with_impulses(const Mesh& original, double level) {
  Mesh noisy = add_noise(original, level, 1, NoiseKind::kNormal);
  std::mt19937_64 random(1);
  std::bernoulli_distribution is_moved(0.1);
  for (std::size_t v = 0; v < noisy.positions.size(); ++v) {
    if (!is_moved(random)) noisy.positions[v] = original.positions[v];
  }
  return noisy;
}

TEST(NoiseLevel, ImpulsesThatAreFewStandOutAlone) {
  for (const Mesh& original : {test::icosphere(5), test::cad_part(4).mesh}) {
    const LoneImpulses impulses = level_of(with_impulses(original, 0.5)).impulses;
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

TEST(NoiseLevel, IsotropicNoiseLooksGaussianWithinTheSurface) {
  const Mesh noisy = add_noise(test::icosphere(5), 0.3, 1, NoiseKind::kGaussian);
  const NoiseLevel level = level_of(noisy);
  EXPECT_NEAR(level.tangential_tail, std::log(10) / std::log(2), 0.4);  // squares of two Gaussians are exponential
}

}  // namespace
}  // namespace crease
