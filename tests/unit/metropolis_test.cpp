#include "core/solve/metropolis.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>

#include "core/solve/edge_process.h"
#include "core/solve/vertex_process.h"
#include "tests/support/meshes.h"
#include "tests/support/smooth_support.h"

namespace crease {
namespace {

/// Two faces that meet at `angle` (radians): one interior edge.
Mesh hinge(double angle) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {0, 1, 0}, {-1, 0.5, 0}, {std::cos(angle), 0.5, -std::sin(angle)}};
  mesh.triangles = {{0, 1, 2}, {1, 0, 3}};
  return mesh;
}

TEST(Metropolis, AcceptsWithTheProbabilityOfTheRule) {
  const CounterRandom random(9, RandomStream::kEdgeProcess);
  for (const double x : {-1.0, 0.0, 0.1, 0.7, 1.5, 4.0}) {
    constexpr std::uint32_t kTrials = 40'000;
    std::uint32_t accepted = 0;
    for (std::uint32_t i = 0; i < kTrials; ++i) accepted += metropolis_accepts(x * 0.3, 0.3, random(1, i)[0]) ? 1 : 0;
    const double expected = std::min(1.0, std::exp(-x));
    const double sigma = std::sqrt(expected * (1 - expected) / kTrials);
    EXPECT_NEAR(accepted / static_cast<double>(kTrials), expected, 5 * sigma + 1e-12) << x;
  }
}

TEST(Metropolis, AShortcutAgreesWithTheExponentialEverywhere) {
  for (const double x : {1e-12, 1e-3, 0.2, 1.0, 3.0, 20.0, 1e6}) {
    for (std::uint64_t word = 0; word < (std::uint64_t{1} << 32); word += 0x00fedcba) {
      const auto w = static_cast<std::uint32_t>(word);
      EXPECT_EQ(metropolis_accepts(x, 1.0, w), CounterRandom::unit(w) < std::exp(-x)) << x << " " << word;
    }
  }
}

MrfOptions options_with(double smoothness_weight, double threshold, double support_weight) {
  MrfOptions options;
  options.likelihood_weight = 0.1;
  options.smoothness_weight = smoothness_weight;
  options.sharpness_weight = 1;
  options.sharpness_threshold = threshold;
  options.support_weight = support_weight;
  return options;
}

// One label: the Gibbs distribution on [0, 1] is proportional to exp(−cε/T), c the slope of E.
TEST(Metropolis, OneLabelFollowsTheGibbsDistribution) {
  const MrfOptions options = options_with(1, 0.9, 0.5);
  for (const double angle : {0.2, 1.2}) {
    const Mesh mesh = hinge(angle);
    const Topology topology = build_topology(mesh);
    test::FieldWithEnergy state(Field(mesh, topology), options);
    const Field& field = state.field;
    ThreadTeam& alone = state.alone;
    EdgeProcess process(state.field, state.terms, state.weights());
    const Schedule schedule = schedule_edges(topology);
    const Index edge = schedule.sites.at(0);
    const double temperature = 0.4, rate = process.slope(edge) / temperature;

    constexpr int kSweeps = 200'000, kBins = 10;
    std::array<int, kBins> histogram{};
    const CounterRandom random(4, RandomStream::kEdgeProcess);
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      process.sweep(schedule, random, static_cast<std::uint32_t>(sweep), temperature, alone);
      ++histogram[std::min<std::size_t>(kBins - 1, static_cast<std::size_t>(field.labels[edge] * kBins))];
    }
    for (int bin = 0; bin < kBins; ++bin) {
      const double expected =
          (std::exp(-rate * bin / kBins) - std::exp(-rate * (bin + 1) / kBins)) / (1 - std::exp(-rate));
      // Successive samples are correlated: allow for a tenth as many independent ones.
      const double sigma = std::sqrt(expected * (1 - expected) / (kSweeps / 10.0));
      EXPECT_NEAR(histogram[static_cast<std::size_t>(bin)] / double{kSweeps}, expected, 5 * sigma) << bin;
    }
  }
}

// Two labels in a row support each other: E = a ε₁ + b ε₂ − s ε₁ε₂; moments by numerical integration.
TEST(Metropolis, TwoCoupledLabelsFollowTheGibbsDistribution) {
  // A strip bent along two collinear edges.
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {0, 1, 0}, {0, 2, 0}, {-1, 0.5, 0}, {-1, 1.5, 0}, {0.6, 0.5, -0.8}, {0.6, 1.5, -0.8}};
  mesh.triangles = {{0, 1, 3}, {1, 2, 4}, {1, 0, 5}, {2, 1, 6}};
  const Topology topology = build_topology(mesh);
  const MrfOptions options = options_with(0.2, 1.3, 0.8);
  test::FieldWithEnergy state(Field(mesh, topology), options);
  const Field& field = state.field;
  ThreadTeam& alone = state.alone;
  EdgeProcess process(state.field, state.terms, state.weights());
  const Schedule schedule = schedule_edges(topology);
  ASSERT_EQ(schedule.sites.size(), 2U);
  const double temperature = 0.3;
  const double a = process.slope(schedule.sites[0]), b = process.slope(schedule.sites[1]);
  process.set_label(schedule.sites[1], 1);
  const double coupling = process.slope(schedule.sites[0]) - a;
  EXPECT_NEAR(coupling, -options.sharpness_weight * options.support_weight, 1e-9);

  double weight = 0, mean = 0, product = 0;
  constexpr int kGrid = 400;
  for (int i = 0; i < kGrid; ++i) {
    for (int j = 0; j < kGrid; ++j) {
      const double x = (i + 0.5) / kGrid, y = (j + 0.5) / kGrid;
      const double p = std::exp(-(a * x + b * y + coupling * x * y) / temperature);
      weight += p;
      mean += p * x;
      product += p * x * y;
    }
  }
  constexpr int kSweeps = 200'000;
  double sampled_mean = 0, sampled_product = 0;
  const CounterRandom random(6, RandomStream::kEdgeProcess);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    process.sweep(schedule, random, static_cast<std::uint32_t>(sweep), temperature, alone);
    sampled_mean += field.labels[schedule.sites[0]];
    sampled_product += field.labels[schedule.sites[0]] * field.labels[schedule.sites[1]];
  }
  EXPECT_NEAR(sampled_mean / kSweeps, mean / weight, 0.01);
  EXPECT_NEAR(sampled_product / kSweeps, product / weight, 0.01);
}

// Without the prior a vertex is Gaussian round its measured position with variance T/2α in each coordinate.
TEST(Metropolis, AVertexUnderTheLikelihoodAloneIsGaussian) {
  const Mesh mesh = hinge(0.5);
  const Topology topology = build_topology(mesh);
  const double alpha = 2.0, temperature = 0.02;
  MrfOptions options = options_with(0, 1, 0);
  options.likelihood_weight = alpha;
  test::FieldWithEnergy state(Field(mesh, topology), options);
  const Field& field = state.field;
  const Schedule schedule = schedule_vertices(mesh, topology);
  VertexProcess process(state.field, state.terms, schedule, 1);
  const CounterRandom random(5, RandomStream::kVertexProcess);
  constexpr int kSweeps = 100'000;
  Vec3 sum = Vec3::Zero(), squares = Vec3::Zero();
  double fourth = 0;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    process.sweep(state.weights(), random, static_cast<std::uint32_t>(sweep), temperature, 0.15, state.alone);
    const Vec3 d = field.positions[2] - field.measured[2];
    sum += d;
    squares += d.cwiseAbs2();
    fourth += d.x() * d.x() * d.x() * d.x();
  }
  const double variance = temperature / (2 * alpha);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(sum[axis] / kSweeps, 0, 0.05 * std::sqrt(variance));
    EXPECT_NEAR(squares[axis] / kSweeps, variance, 0.05 * variance);
  }
  EXPECT_NEAR(fourth / kSweeps, 3 * variance * variance, 0.3 * variance * variance);
}

TEST(Metropolis, NormalsFollowTheAcceptedMoves) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : test::mesh_family()) {
    const Topology topology = build_topology(mesh);
    test::FieldWithEnergy state(Field(mesh, topology), options_with(1, 0.6, 0.5));
    const Field& field = state.field;
    const Schedule schedule = schedule_vertices(mesh, topology);
    ThreadTeam team(2);
    VertexProcess process(state.field, state.terms, schedule, team.size());
    for (std::uint32_t sweep = 1; sweep <= 5; ++sweep) {
      process.sweep(state.weights(), CounterRandom(1, RandomStream::kVertexProcess), sweep, 0.1, 0.1, team);
    }
    for (std::size_t f = 0; f < field.faces.size(); ++f) {
      EXPECT_LT((field.normals[f] - field.face_normal(f)).norm(), 1e-5) << name << " face " << f;
    }
  }
}

TEST(ThreadTeam, EveryIndexIsVisitedOnce) {
  for (const std::uint32_t threads : {1U, 2U, 5U}) {
    ThreadTeam team(threads);
    for (const std::size_t count : {0U, 1U, 7U, 1000U}) {
      std::vector<std::atomic<int>> visits(count);
      for (int repeat = 0; repeat < 50; ++repeat) {
        team.run(count, 16, [&](std::size_t begin, std::size_t end, std::size_t thread) {
          ASSERT_LT(thread, team.size());
          for (std::size_t i = begin; i < end; ++i) ++visits[i];
        });
      }
      for (const auto& visit : visits) EXPECT_EQ(visit.load(), 50);
    }
  }
}

}  // namespace
}  // namespace crease
