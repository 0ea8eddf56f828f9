#include "core/smooth/smooth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/measure/measure.h"
#include "core/measure/noise.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

MrfOptions short_run(std::uint32_t sweeps = 20) {
  MrfOptions options;
  options.solver = Solver::kMetropolis;
  options.sweeps = sweeps;
  options.process = Process::kVertex;
  return options;
}

SmoothResult run(const Mesh& mesh, const MrfOptions& options, std::uint32_t threads = 1) {
  RunContext context;
  return smooth(mesh, build_topology(mesh), {options, threads}, context);
}

void expect_same_bits(const SmoothResult& a, const SmoothResult& b) {
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.labels, b.labels);
  ASSERT_EQ(a.sweeps.size(), b.sweeps.size());
  for (std::size_t i = 0; i < a.sweeps.size(); ++i) {
    EXPECT_EQ(a.sweeps[i].energy.total(), b.sweeps[i].energy.total()) << "sweep " << i + 1;
  }
}

TEST(Smooth, AnyNumberOfThreadsGivesTheSameBits) {
  const Mesh mesh = add_noise(test::icosphere(4), 0.3, 1, NoiseKind::kGaussian);
  const MrfOptions options = short_run();
  const SmoothResult one = run(mesh, options);
  for (const std::uint32_t threads : {2U, 3U, 7U}) {
    expect_same_bits(run(mesh, options, threads), one);
  }
}

TEST(Smooth, ADifferentSeedGivesADifferentResult) {
  const Mesh mesh = add_noise(test::icosphere(2), 0.3, 1, NoiseKind::kGaussian);
  MrfOptions options = short_run();
  const SmoothResult first = run(mesh, options);
  options.seed = 2;
  EXPECT_NE(run(mesh, options).positions, first.positions);
}

TEST(Smooth, ResultsAreFiniteWithLabelsFromZeroToOneForEveryMesh) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : test::mesh_family()) {
    const Topology topology = build_topology(mesh);
    RunContext context;
    const SmoothResult result = smooth(mesh, topology, {short_run(), 1}, context);
    ASSERT_EQ(result.positions.size(), mesh.positions.size()) << name;
    ASSERT_EQ(result.labels.size(), topology.edges.size()) << name;
    for (std::size_t v = 0; v < result.positions.size(); ++v) {
      EXPECT_TRUE(result.positions[v].allFinite()) << name;
      if (topology.vertex_faces[v].empty()) {
        EXPECT_EQ(result.positions[v], mesh.positions[v]) << name;
      }
    }
    for (std::size_t e = 0; e < result.labels.size(); ++e) {
      EXPECT_GE(result.labels[e], 0) << name;
      EXPECT_LE(result.labels[e], 1) << name;
      if (!topology.is_interior(e)) {
        EXPECT_EQ(result.labels[e], 0) << name;
      }
    }
  }
}

TEST(Smooth, ScalingByAPowerOfTwoScalesTheResultExactly) {
  const Mesh mesh = add_noise(test::cube(5), 0.2, 1, NoiseKind::kGaussian);
  Mesh scaled = mesh;
  for (Vec3& position : scaled.positions) position *= 4;
  const SmoothResult result = run(mesh, short_run()), other = run(scaled, short_run());
  EXPECT_EQ(result.labels, other.labels);
  for (std::size_t v = 0; v < result.positions.size(); ++v) EXPECT_EQ(other.positions[v], 4 * result.positions[v]);
}

TEST(Smooth, APlaneStaysAPlaneAsTheTemperatureVanishes) {
  const Mesh mesh = test::grid(12, 12);
  MrfOptions options = short_run(40);
  options.vertex_temperature_start = options.vertex_temperature_end = 1e-9;
  const SmoothResult result = run(mesh, options);
  for (const Vec3& position : result.positions) EXPECT_NEAR(position.z(), 0, 1e-3);
}

TEST(Smooth, ANoisyPlaneBecomesFlatter) {
  const Mesh plane = test::grid(20, 20);
  const Mesh noisy = add_noise(plane, 0.2, 3, NoiseKind::kNormal);
  Mesh result = plane;
  result.positions = run(noisy, short_run(200)).positions;
  EXPECT_LT(measure(plane, result).mean_normal_error_deg, 0.2 * measure(plane, noisy).mean_normal_error_deg);
}

TEST(Smooth, FindsTheRidgesOfANoisyCube) {
  const Mesh cube = test::cube(12);
  const Mesh noisy = add_noise(cube, 0.2, 5, NoiseKind::kNormal);
  const Topology topology = build_topology(noisy);
  RunContext context;
  MrfOptions options;
  options.solver = Solver::kMetropolis;
  const SmoothResult result = smooth(noisy, topology, {options}, context);
  Mesh smoothed = cube;
  smoothed.positions = result.positions;
  const EdgeLabels labels{topology.edges, result.labels};
  const Measurement after = measure(cube, smoothed, &labels);
  EXPECT_GT(after.labels->f1, 0.95);
  EXPECT_LT(after.mean_normal_error_deg, 4);
}

TEST(Smooth, WithoutTheEdgeProcessEveryLabelIsZero) {
  MrfOptions options = short_run();
  options.edge_process = false;
  const SmoothResult result = run(test::cube(4), options);
  EXPECT_EQ(std::ranges::count(result.labels, 0.0), static_cast<std::ptrdiff_t>(result.labels.size()));
  EXPECT_EQ(result.label_proposals, 0U);
}

TEST(Smooth, RecordsEverySweepAndFollowsItsSchedules) {
  MrfOptions options = short_run(30);
  const SmoothResult result = run(add_noise(test::cube(6), 0.3, 1, NoiseKind::kGaussian), options);
  ASSERT_EQ(result.sweeps.size(), 30U);
  const auto expect_geometric = [&](double SweepRecord::*field, double start, double end) {
    EXPECT_NEAR(result.sweeps.front().*field, start, 1e-12 * start);
    EXPECT_NEAR(result.sweeps.back().*field, end, 1e-12 * start);
    for (std::size_t i = 1; i < result.sweeps.size(); ++i) {
      EXPECT_NEAR(result.sweeps[i].*field / result.sweeps[i - 1].*field, std::pow(end / start, 1.0 / 29), 1e-9);
    }
  };
  expect_geometric(&SweepRecord::likelihood_weight, options.likelihood_weight_start, options.likelihood_weight);
  expect_geometric(&SweepRecord::temperature, options.vertex_temperature_start, options.vertex_temperature_end);
  expect_geometric(&SweepRecord::label_temperature, options.label_temperature_start, options.label_temperature_end);
  for (std::size_t i = 0; i < result.sweeps.size(); ++i) EXPECT_EQ(result.sweeps[i].sweep, i + 1);
}

TEST(Smooth, TheStepSizeFollowsTheAcceptanceRate) {
  const Mesh noisy = add_noise(test::icosphere(3), 0.3, 1, NoiseKind::kGaussian);
  for (const double start : {0.001, 1.0}) {
    MrfOptions options = short_run(250);
    options.step_size = start;
    options.vertex_temperature_start = options.vertex_temperature_end = 0.01;
    EXPECT_NEAR(run(noisy, options).sweeps.back().acceptance, 0.4, 0.1) << start;
  }
}

/// What is done of an automatic run never falls, and what follows the last stage is still to come then.
TEST(Smooth, AnAutomaticRunTellsHowMuchIsDone) {
  const Mesh noisy = add_noise(test::cube(8), 0.1, 1, NoiseKind::kGaussian);
  std::vector<double> fractions;
  RunContext context;
  context.on_sweep = [&](const SweepView& view) {
    fractions.push_back(view.fraction.value_or(0));
    return true;
  };
  smooth(noisy, build_topology(noisy), {MrfOptions{}, 1}, context);
  ASSERT_GT(fractions.size(), 6U);
  EXPECT_TRUE(std::ranges::is_sorted(fractions));
  EXPECT_GT(fractions.front(), 0);
  EXPECT_LT(fractions.back(), 1);
  EXPECT_GT(fractions.back(), 0.5);
}

TEST(Smooth, StopsBeforeTheNextSweepWhenAsked) {
  RunContext context;
  std::uint32_t calls = 0;
  context.on_sweep = [&](const SweepView& view) {
    ++calls;
    EXPECT_EQ(view.record.sweep, calls);
    EXPECT_EQ(view.sweeps, 1000U);
    EXPECT_EQ(view.positions().size(), test::cube(3).positions.size());
    return calls < 7;
  };
  const Mesh mesh = test::cube(3);
  const SmoothResult result = smooth(mesh, build_topology(mesh), {short_run(1000), 1}, context);
  EXPECT_TRUE(result.cancelled);
  EXPECT_EQ(result.sweeps.size(), 7U);

  RunContext cancelled;
  cancelled.cancel = true;
  EXPECT_EQ(smooth(mesh, build_topology(mesh), {short_run(1000), 1}, cancelled).sweeps.size(), 1U);
}

}  // namespace
}  // namespace crease
