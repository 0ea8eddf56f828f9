#include <gtest/gtest.h>

#include <cmath>

#include "core/choice/families.h"
#include "core/choice/noise_level.h"
#include "core/graduated/descent.h"
#include "core/graduated/fast_math.h"
#include "core/measure/measure.h"
#include "core/measure/noise.h"
#include "core/smooth/smooth.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

SmoothResult automatic(const Mesh& mesh, const MrfOptions& options = {}) {
  RunContext context;
  return smooth(mesh, build_topology(mesh), {options, 1}, context);
}

double error_of(const Mesh& original, const Mesh& noisy, const MrfOptions& options = {}) {
  Mesh result = noisy;
  result.positions = automatic(noisy, options).positions;
  return measure(original, result).mean_normal_error_deg;
}

TEST(FastMath, AgreesWithTheLibrary) {
  for (double x = 1e-6; x < 1e6; x *= 1.07) {
    EXPECT_NEAR(fast_log(static_cast<float>(x)), std::log(x), 4e-7 * std::max(1.0, std::abs(std::log(x))));
  }
  for (double x = -40; x < 40; x += 0.37) {
    EXPECT_NEAR(fast_exp(static_cast<float>(x)) / std::exp(x), 1, 4e-6) << x;
  }
}

TEST(GraduatedEnergy, ItsGradientIsThatOfFiniteDifferences) {
  const Mesh mesh = add_noise(test::cube(3), 0.2, 1, NoiseKind::kGaussian);
  const Topology topology = build_topology(mesh);
  const Surface surface(mesh, topology);
  const FlatMesh flat(surface);
  ThreadTeam alone(1);
  for (const float exponent : {0.0F, 0.5F, 1.0F, 2.0F}) {
    GraduatedEnergy energy(flat, flat.measured);
    energy.exponent = exponent;
    energy.fading_area = 0.1F;
    energy.across = 3;
    for (float& scale : energy.edge_scales) scale = 0.3F;
    for (float& area : energy.least_areas) area = 0.4F;
    for (std::size_t v = 0; v < flat.vertex_count; ++v) energy.vertex_normals[v] = 1;
    for (std::size_t f = 0; f < flat.face_count; ++f) energy.face_references[2 * flat.face_count + f] = 1;
    FlatVectors x = flat.measured, gradient(x.size()), unused(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += 0.1F * std::sin(static_cast<float>(i));
    energy(x, gradient, alone);
    constexpr float kStep = 4e-3F;
    for (std::size_t i = 0; i < x.size(); i += 7) {
      const float at = x[i];
      x[i] = at + kStep;
      const double above = energy(x, unused, alone);
      x[i] = at - kStep;
      const double below = energy(x, unused, alone);
      x[i] = at;
      EXPECT_NEAR((above - below) / (2 * kStep), gradient[i], 0.02 * (1 + std::abs(gradient[i]))) << exponent;
    }
  }
}

TEST(Automatic, LeavesMeshesWithoutNoiseAllButUnchanged) {
  for (const Mesh& mesh : {test::cube(1), test::cube(8), test::cad_part(3).mesh, test::icosphere(3)}) {
    const SmoothResult result = automatic(mesh);
    const double unit = mean_edge_length(mesh.positions, build_topology(mesh).edges);
    double moved = 0;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      moved += (result.positions[v] - mesh.positions[v]).norm() / unit / static_cast<double>(mesh.positions.size());
    }
    EXPECT_LT(moved, 0.02) << mesh.triangles.size();
  }
}

TEST(Automatic, SmoothsACubeFarBetterThanItsNoise) {
  const Mesh original = test::cube(16);
  for (const NoiseKind kind : {NoiseKind::kNormal, NoiseKind::kGaussian}) {
    const Mesh noisy = add_noise(original, 0.3, 1, kind);
    EXPECT_LT(error_of(original, noisy), 0.15 * measure(original, noisy).mean_normal_error_deg);
  }
}

TEST(Automatic, SaysWhatItEstimated) {
  const Mesh noisy = add_noise(test::cube(20), 0.3, 1, NoiseKind::kNormal);
  const SmoothResult result = automatic(noisy);
  ASSERT_TRUE(result.choice);
  EXPECT_NEAR(result.choice->noise_sigma, 0.28, 0.04);
  EXPECT_EQ(result.choice->direction, NoiseDirection::kNormal);
  EXPECT_FALSE(result.choice->candidates.empty());
}

TEST(Automatic, StrengthZeroLeavesTheUploadAsItIs) {
  const Mesh noisy = add_noise(test::cube(6), 0.3, 1, NoiseKind::kNormal);
  MrfOptions options;
  options.strength = 0;
  EXPECT_EQ(automatic(noisy, options).positions, noisy.positions);
}

}  // namespace
}  // namespace crease
