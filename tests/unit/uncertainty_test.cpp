#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

#include "core/choice/linear_field.h"
#include "core/measure/noise.h"
#include "core/smooth/smooth.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

MrfOptions with_uncertainty() {
  MrfOptions options;
  options.uncertainty = true;
  return options;
}

SmoothResult solved(const Mesh& mesh, const MrfOptions& options, std::uint32_t threads = 1,
                    const std::vector<double>& weights = {}) {
  RunContext context;
  return smooth(mesh, build_topology(mesh), {options, threads}, context, weights);
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

Mesh noisy_cube(double sigma) { return add_noise(test::cube(12), sigma, 1, NoiseKind::kNormal); }

TEST(Uncertainty, ChangesNeitherPositionsNorLabels) {
  const Mesh mesh = noisy_cube(0.3);
  const SmoothResult with = solved(mesh, with_uncertainty()), without = solved(mesh, {});
  EXPECT_EQ(with.positions, without.positions);
  EXPECT_EQ(with.labels, without.labels);
  EXPECT_EQ(with.sigma.size(), mesh.positions.size());
  EXPECT_TRUE(without.sigma.empty());
}

TEST(Uncertainty, IsTheSameForAnyNumberOfThreads) {
  const Mesh mesh = add_noise(test::cube(28), 0.2, 1, NoiseKind::kNormal);
  MrfOptions options = with_uncertainty();
  options.surface = SurfaceOption::kOrganic;
  EXPECT_EQ(solved(mesh, options, 1).sigma, solved(mesh, options, 3).sigma);
}

TEST(Uncertainty, ScalesWithTheUpload) {
  const Mesh mesh = noisy_cube(0.3);
  Mesh larger = mesh;
  for (Vec3& position : larger.positions) position *= 1024;
  const std::vector<double> small = solved(mesh, with_uncertainty()).sigma;
  const std::vector<double> large = solved(larger, with_uncertainty()).sigma;
  for (std::size_t v = 0; v < small.size(); ++v) EXPECT_NEAR(large[v], 1024 * small[v], 1e-6 * large[v]);
}

TEST(Uncertainty, GrowsWithTheNoise) {
  double before = 0;
  for (const double sigma : {0.05, 0.15, 0.4}) {
    const double mean = mean_of(solved(noisy_cube(sigma), with_uncertainty()).sigma);
    EXPECT_GT(mean, 1.2 * before) << sigma;
    before = mean;
  }
}

TEST(Uncertainty, IsLargerOnRidgesThanOnFlats) {
  const Mesh original = test::cube(12);
  Vec3 low = original.positions.front(), high = low;
  for (const Vec3& position : original.positions) {
    low = low.cwiseMin(position);
    high = high.cwiseMax(position);
  }
  const std::vector<double> sigma = solved(add_noise(original, 0.2, 1, NoiseKind::kNormal), with_uncertainty()).sigma;
  std::vector<double> ridges, flats;
  for (std::size_t v = 0; v < sigma.size(); ++v) {
    int bounds = 0;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double x = original.positions[v][axis];
      bounds += std::min(x - low[axis], high[axis] - x) < 1e-9 ? 1 : 0;
    }
    (bounds >= 2 ? ridges : flats).push_back(sigma[v]);
  }
  EXPECT_GT(mean_of(ridges), 1.1 * mean_of(flats));
}

TEST(Uncertainty, IsAPositiveNumberOnEveryMesh) {
  for (const auto& member : test::mesh_family()) {
    const Mesh noisy = add_noise(member.mesh, 0.2, 1, NoiseKind::kGaussian);
    const Topology topology = build_topology(noisy);
    const double unit = mean_edge_length(noisy.positions, topology.edges);
    std::vector<double> weights(noisy.positions.size(), 1);
    for (std::size_t v = 0; v < weights.size(); v += 3) weights[v] = 0;
    MrfOptions unmoved = with_uncertainty(), correlated = with_uncertainty();
    unmoved.strength = 0;
    correlated.noise = NoiseOption::kCorrelated;
    for (const auto& result :
         {solved(member.mesh, with_uncertainty()), solved(noisy, with_uncertainty()),
          solved(noisy, with_uncertainty(), 1, weights), solved(noisy, unmoved), solved(noisy, correlated)}) {
      SCOPED_TRACE(member.name);
      ASSERT_EQ(result.sigma.size(), noisy.positions.size());
      for (const double sigma : result.sigma) {
        EXPECT_TRUE(std::isfinite(sigma));
        EXPECT_GE(sigma, 0);
        EXPECT_LT(sigma, 100 * unit);
      }
    }
  }
}

TEST(Uncertainty, OfAMeshWithoutExtentIsZero) {
  const Mesh point{{Vec3(1, 2, 3), Vec3(1, 2, 3), Vec3(1, 2, 3)}, {{0, 1, 2}}};
  EXPECT_EQ(solved(point, with_uncertainty()).sigma, std::vector<double>(3, 0));
}

TEST(Uncertainty, IsThatOfTheNoiseWhereTheUploadStaysAsItIs) {
  const Mesh mesh = noisy_cube(0.3);
  MrfOptions options = with_uncertainty();
  options.strength = 0;
  options.noise_sigma = 0.25;
  const double unit = mean_edge_length(mesh.positions, build_topology(mesh).edges);
  for (const double sigma : solved(mesh, options).sigma) EXPECT_NEAR(sigma, 0.25 * unit, 1e-12);
}

TEST(Uncertainty, GoesOnFromACheckpointWithTheSameBits) {
  const Mesh mesh = noisy_cube(0.3);
  const Topology topology = build_topology(mesh);
  const SmoothResult whole = solved(mesh, with_uncertainty());
  std::string state;
  std::uint32_t last_sweep = 0;
  RunContext first;
  first.on_sweep = [&](const SweepView& view) {
    const bool after_the_solves = view.record.sweep == std::exchange(last_sweep, view.record.sweep);
    if (after_the_solves) state = view.checkpoint();
    return !after_the_solves;
  };
  const SmoothResult stopped = smooth(mesh, topology, {with_uncertainty(), 1}, first);
  EXPECT_TRUE(stopped.cancelled);
  EXPECT_TRUE(stopped.sigma.empty());
  ASSERT_FALSE(state.empty());
  RunContext second;
  second.checkpoint = state;
  const SmoothResult resumed = smooth(mesh, topology, {with_uncertainty(), 2}, second);
  EXPECT_EQ(resumed.positions, whole.positions);
  EXPECT_EQ(resumed.sigma, whole.sigma);
  EXPECT_EQ(resumed.sweeps.size(), whole.sweeps.size());
}

/// `estimated` is the mean square of so many draws of eight; `exact` are diagonals of covariances, which their squares
/// have for mean.
void expect_variances(const std::vector<double>& exact,
                      const std::function<std::vector<Samples>(std::uint32_t)>& draw) {
  constexpr std::uint32_t kDrawsOfEight = 200;
  std::vector<double> estimated(exact.size());
  for (std::uint32_t number = 0; number < kDrawsOfEight; ++number) {
    const std::vector<Samples> draws = draw(number);
    for (std::size_t v = 0; v < exact.size(); ++v) {
      estimated[v] += static_cast<double>(sum(draws[v].lanes * draws[v].lanes)) / (8.0 * kDrawsOfEight);
    }
  }
  for (std::size_t v = 0; v < exact.size(); ++v) {
    EXPECT_GT(exact[v], 0);
    EXPECT_LE(exact[v], 1.01);
    EXPECT_NEAR(estimated[v] / exact[v], 1, 0.2) << v;  // five standard deviations of a chi-squared mean
  }
}

/// Of (M⁻¹ P)^times P⁻¹, column by column.
std::vector<double> variances(LinearField& field, std::size_t count, int times) {
  std::vector<double> exact(count);
  for (std::size_t v = 0; v < count; v += Samples::kCount) {
    std::vector<Samples> columns(count);
    for (std::size_t k = 0; k < Samples::kCount && v + k < count; ++k) columns[v + k].lanes[k] = 1;
    for (int time = 0; time < times; ++time) columns = field.response(columns, [] {});
    for (std::size_t k = 0; k < Samples::kCount && v + k < count; ++k) {
      exact[v + k] = static_cast<double>(columns[v + k].lanes[k] / field.precisions()[v + k]);
    }
  }
  return exact;
}

TEST(LinearField, DrawsHaveTheInverseForCovariance) {
  const Mesh mesh = add_noise(test::cube(3), 0.1, 1, NoiseKind::kNormal);
  const Topology topology = build_topology(mesh);
  const Surface surface(mesh, topology);
  const FlatMesh flat(surface);
  ThreadTeam team(1);
  GraduatedOptions options;
  options.variance = 0.01F;
  LinearField field(flat, flat.measured, options, {}, team);
  expect_variances(variances(field, flat.vertex_count, 1),
                   [&](std::uint32_t number) { return field.draw(1, number, [] {}); });
  for (const int steps : {2, 4}) {
    SCOPED_TRACE(steps);
    expect_variances(variances(field, flat.vertex_count, steps),
                     [&](std::uint32_t number) { return field.draw_diffused(1, number, steps, [] {}); });
  }
}

}  // namespace
}  // namespace crease
