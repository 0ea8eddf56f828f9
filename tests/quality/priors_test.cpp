#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/measure/measure.h"
#include "core/measure/noise.h"
#include "core/smooth/smooth.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

/// z = (x² + y²) / 2r on a square of `side` edges.
Mesh paraboloid(int side, double radius) {
  Mesh mesh = test::grid(side, side);
  for (Vec3& position : mesh.positions) {
    position -= Vec3(side / 2.0, side / 2.0, 0);
    position.z() = (position.x() * position.x() + position.y() * position.y()) / (2 * radius);
  }
  return mesh;
}

/// A cylinder without ends, of squares cut along alternating diagonals, with edges of about 1.
Mesh tube(int around, int along) {
  const double radius = around / (2 * std::numbers::pi);
  Mesh mesh;
  for (int row = 0; row <= along; ++row) {
    for (int column = 0; column < around; ++column) {
      const double turn = 2 * std::numbers::pi * column / around;
      mesh.positions.emplace_back(radius * std::cos(turn), radius * std::sin(turn), row);
    }
  }
  const auto at = [&](int column, int row) { return static_cast<Index>(row * around + column % around); };
  for (int row = 0; row < along; ++row) {
    for (int column = 0; column < around; ++column) {
      const Index a = at(column, row), b = at(column + 1, row), c = at(column + 1, row + 1), d = at(column, row + 1);
      const bool rising = (row + column) % 2 == 0;
      mesh.triangles.push_back(rising ? Triangle{a, b, c} : Triangle{a, b, d});
      mesh.triangles.push_back(rising ? Triangle{a, c, d} : Triangle{b, c, d});
    }
  }
  return mesh;
}

Measurement smoothed(const Mesh& noisy, const Mesh& original, const SmoothOptions& options) {
  const Topology topology = build_topology(noisy);
  RunContext context;
  const SmoothResult result = smooth(noisy, topology, options, context);
  Mesh mesh = noisy;
  mesh.positions = result.positions;
  return measure(original, mesh);
}

/// §5: on quadratic surfaces the prior of second differences beats that of first differences, each at the likelihood
/// weight that serves it best; the normal error of the one over that of the other.
double error_ratio(const Mesh& original) {
  const Mesh noisy = add_noise(original, 0.15, 1, NoiseKind::kGaussian);
  const auto best = [&](double smoothness, double curvature) {
    double least = 180;
    for (const double weight : {0.1, 0.3, 1.0, 3.0}) {
      SmoothOptions options;
      options.solver = Solver::kMeanField;
      options.sweeps = 400;
      options.edge_process = false;
      options.likelihood_weight = options.likelihood_weight_start = weight;
      options.smoothness_weight = smoothness;
      options.curvature_weight = curvature;
      least = std::min(least, smoothed(noisy, original, options).mean_normal_error_deg);
    }
    return least;
  };
  const double first = best(1, 0), second = best(0, 10);
  std::printf("  noisy %.2f deg, first-order prior %.2f, piecewise-quadratic prior %.2f\n",
              measure(original, noisy).mean_normal_error_deg, first, second);
  return second / first;
}

TEST(PiecewiseQuadraticPrior, BeatsTheFirstOrderPriorOnACylinder) { EXPECT_LT(error_ratio(tube(20, 40)), 0.92); }

TEST(PiecewiseQuadraticPrior, BeatsTheFirstOrderPriorOnAParaboloid) { EXPECT_LT(error_ratio(paraboloid(40, 8)), 0.9); }

}  // namespace
}  // namespace crease
