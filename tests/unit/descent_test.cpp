#include "core/solve/descent.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/measure/noise.h"
#include "tests/support/meshes.h"
#include "tests/support/smooth_support.h"

namespace crease {
namespace {

/// One option set for every term that descent sees.
std::vector<MrfOptions> descent_variants() {
  std::vector<MrfOptions> variants(9);
  variants[1].smoothness = Smoothness::kSquareRoot;
  variants[2].smoothness = Smoothness::kHuber;
  variants[3].likelihood = LikelihoodKind::kHuber;
  variants[3].likelihood_width = 0.05;
  variants[4].likelihood = LikelihoodKind::kAnisotropic;
  variants[5].likelihood = LikelihoodKind::kVolume;
  variants[6].curvature_weight = 0.9;
  variants[7].ridge_line_weight = 0.7;
  variants[8].likelihood = LikelihoodKind::kAnisotropic;
  variants[8].scan_direction = {0, 1, 2};
  for (MrfOptions& options : variants) options.likelihood_weight = 0.8;
  return variants;
}

template <typename Real>
std::vector<Real> flat(const std::vector<Vec3>& vectors) {
  std::vector<Real> result;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    for (const Vec3& vector : vectors) result.push_back(static_cast<Real>(vector[axis]));
  }
  return result;
}

TEST(EnergyGradient, EqualsFiniteDifferences) {
  for (const MrfOptions& options : descent_variants()) {
    for (const auto& [name, mesh, manifold, closed, degenerate] : test::mesh_family()) {
      const Topology topology = build_topology(mesh);
      test::FieldWithEnergy state(test::shaken_field(mesh, topology, 5), options);
      EnergyGradient<double> energy(state.field, state.terms);
      std::vector<double> x = flat<double>(state.field.positions), gradient(x.size()), unused(x.size());
      energy(state.weights(), x, gradient, state.alone);
      constexpr double kStep = 1e-5;
      for (std::size_t i = 0; i < x.size(); i += 1 + x.size() / 40) {
        const double here = x[i];
        x[i] = here + kStep;
        const double above = energy(state.weights(), x, unused, state.alone);
        x[i] = here - kStep;
        const double below = energy(state.weights(), x, unused, state.alone);
        x[i] = here;
        EXPECT_NEAR(gradient[i], (above - below) / (2 * kStep), 2e-4 * (1 + std::abs(gradient[i]))) << name;
      }
    }
  }
}

// Where no face is near to having no area, the faded normals are the field's.
TEST(EnergyGradient, ItsValueIsTheEnergyOfTheReports) {
  for (const MrfOptions& options : descent_variants()) {
    if (options.smoothness == Smoothness::kSquareRoot) continue;  // rounded off in descent
    const Mesh mesh = test::icosphere(3);
    const Topology topology = build_topology(mesh);
    test::FieldWithEnergy state(test::shaken_field(mesh, topology, 5), options);
    const Energy all = state.energy();
    const double expected =
        all.of<LikelihoodTerm>() + all.of<SmoothnessTerm>() + all.of<CurvatureTerm>() + all.of<RidgeLineTerm>();
    const std::vector<double> x = flat<double>(state.field.positions);
    std::vector<double> gradient(x.size());
    EXPECT_NEAR(EnergyGradient<double>(state.field, state.terms)(state.weights(), x, gradient, state.alone), expected,
                1e-4 * expected);
  }
}

TEST(EnergyGradient, SinglePrecisionAgreesWithDouble) {
  for (const MrfOptions& options : descent_variants()) {
    const Mesh mesh = test::icosphere(3);
    const Topology topology = build_topology(mesh);
    test::FieldWithEnergy state(test::shaken_field(mesh, topology, 5), options);
    const std::vector<double> x = flat<double>(state.field.positions);
    const std::vector<float> rounded = flat<float>(state.field.positions);
    std::vector<double> gradient(x.size());
    std::vector<float> rough(x.size());
    const double value = EnergyGradient<double>(state.field, state.terms)(state.weights(), x, gradient, state.alone);
    EXPECT_NEAR(EnergyGradient<float>(state.field, state.terms)(state.weights(), rounded, rough, state.alone), value,
                1e-4 * value);
    for (std::size_t i = 0; i < x.size(); ++i) {
      ASSERT_NEAR(static_cast<double>(rough[i]), gradient[i], 2e-3 * (1 + std::abs(gradient[i])));
    }
  }
}

TEST(EnergyGradient, ThreadsDoNotChangeABit) {
  const Mesh mesh = test::icosphere(5);
  const Topology topology = build_topology(mesh);
  test::FieldWithEnergy state(test::shaken_field(mesh, topology, 5), {});
  const std::vector<double> x = flat<double>(state.field.positions);
  EnergyGradient<double> energy(state.field, state.terms);
  std::vector<double> one(x.size()), three(x.size());
  ThreadTeam team(3);
  EXPECT_EQ(energy(state.weights(), x, one, state.alone), energy(state.weights(), x, three, team));
  EXPECT_EQ(one, three);
}

TEST(Descent, LowersTheEnergyStepByStep) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : test::mesh_family()) {
    const Mesh noisy = add_noise(mesh, 0.3, 1, NoiseKind::kGaussian);
    const Topology topology = build_topology(noisy);
    test::FieldWithEnergy state(Field(noisy, topology), {});
    EnergyGradient<double> energy(state.field, state.terms);
    std::vector<double> unused(3 * noisy.positions.size());
    const auto value = [&] {
      return energy(state.weights(), flat<double>(state.field.positions), unused, state.alone);
    };
    Descent descent(state.field, state.terms);
    double last = value();
    const double first = last;
    for (int step = 0; step < 30; ++step) {
      descent.step(state.weights(), state.alone);
      const double now = value();
      ASSERT_LE(now, last * (1 + 1e-12)) << name << ", step " << step;
      last = now;
    }
    EXPECT_LT(last, mesh.positions.size() > 50 ? 0.7 * first : first + 1e-9) << name;
  }
}

TEST(Descent, FixedVerticesKeepTheirPlaces) {
  const Mesh mesh = add_noise(test::grid(8, 8), 0.3, 1, NoiseKind::kGaussian);
  const Topology topology = build_topology(mesh);
  test::FieldWithEnergy state(Field(mesh, topology), {});
  std::vector<std::uint8_t> fixed(mesh.positions.size(), 0);
  for (std::size_t v = 0; v < fixed.size(); v += 2) fixed[v] = 1;
  Descent descent(state.field, state.terms, fixed);
  for (int step = 0; step < 10; ++step) descent.step(state.weights(), state.alone);
  for (std::size_t v = 0; v < fixed.size(); ++v) {
    EXPECT_EQ(state.field.positions[v] == state.field.measured[v], fixed[v] == 1) << v;
  }
}

// The minimum of a quadratic function in n variables is n steps of conjugate gradients away, in exact arithmetic.
TEST(ConjugateGradients, FindTheMinimumOfAQuadraticFunctionAndSayThatTheyAreThere) {
  const std::vector<double> weights{1, 3, 10, 0.5, 2, 7};
  const auto quadratic = [&](std::span<const double> x, std::span<double> gradient) {
    double value = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      gradient[i] = 2 * weights[i] * (x[i] - 1);
      value += weights[i] * (x[i] - 1) * (x[i] - 1);
    }
    return value;
  };
  ThreadTeam alone(1);
  ConjugateGradients search(weights.size());
  std::vector<double> x(weights.size(), 0);
  int steps = 0;
  while (search.step(x, quadratic, alone)) ASSERT_LT(++steps, 200);
  for (const double one : x) EXPECT_NEAR(one, 1, 1e-6);
}

}  // namespace
}  // namespace crease
