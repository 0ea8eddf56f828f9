#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/io/decode.h"
#include "core/measure/measure.h"
#include "core/measure/noise.h"
#include "core/smooth/smooth.h"
#include "tests/support/meshes.h"
#include "tests/support/smooth_support.h"

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

/// §5: on quadratic surfaces the prior of second differences beats that of first differences, each at the likelihood
/// weight that serves it best; the normal error of the one over that of the other.
double error_ratio(const Mesh& original) {
  const Mesh noisy = add_noise(original, 0.15, 1, NoiseKind::kGaussian);
  const auto best = [&](double smoothness, double curvature) {
    double least = 180;
    for (const double weight : {0.1, 0.3, 1.0, 3.0}) {
      MrfOptions options;
      options.solver = Solver::kMetropolis;
      options.conjugate_gradients = true;
      options.sweeps = 400;
      options.edge_process = false;
      options.likelihood_weight = options.likelihood_weight_start = weight;
      options.smoothness_weight = smoothness;
      options.curvature_weight = curvature;
      least = std::min(least, test::measure_smoothed(noisy, original, options).mean_normal_error_deg);
    }
    return least;
  };
  const double first = best(1, 0), second = best(0, 10);
  std::printf("  noisy %.2f deg, first-order prior %.2f, piecewise-quadratic prior %.2f\n",
              measure(original, noisy).mean_normal_error_deg, first, second);
  return second / first;
}

/// Mean |dihedral angle| in degrees over the edges of `mesh` that are ridges of the original and convex, or concave.
double mean_ridge_angle(const Mesh& original, const Mesh& mesh, bool concave) {
  const Topology topology = build_topology(original);
  const std::vector<double> before = signed_dihedral_angles(original, topology, original.positions);
  const std::vector<double> after = signed_dihedral_angles(original, topology, mesh.positions);
  double sum = 0, count = 0;
  for (std::size_t e = 0; e < before.size(); ++e) {
    if (std::abs(before[e]) < 40 * std::numbers::pi / 180 || (before[e] < 0) != concave) continue;
    sum += std::abs(after[e]) * 180 / std::numbers::pi;
    ++count;
  }
  return sum / count;
}

// The paper's Fig. 5.
TEST(CurvatureClamping, KeepsTheRidgesOfOneKindAndSmoothsTheOthersAway) {
  const auto path = test::cgal_mesh("fandisk.off");
  if (!path) GTEST_SKIP() << "libcgal-demo is not installed";
  const Mesh original = decode_mesh(test::read_file(*path), MeshFormat::kOff).mesh;
  const Mesh noisy = add_noise(original, 0.2, 1, NoiseKind::kNormal);
  const Topology topology = build_topology(noisy);
  for (const RidgeKind kind : {RidgeKind::kConvex, RidgeKind::kConcave}) {
    MrfOptions options;
    options.solver = Solver::kMetropolis;
    options.ridge_kind = kind;
    RunContext context;
    Mesh mesh = noisy;
    mesh.positions = smooth(noisy, topology, {options}, context).positions;
    const bool keeps_concave = kind == RidgeKind::kConcave;
    const double kept = mean_ridge_angle(original, mesh, keeps_concave);
    const double clamped = mean_ridge_angle(original, mesh, !keeps_concave);
    std::printf("  kept %.1f deg of %.1f, clamped to %.1f of %.1f\n", kept,
                mean_ridge_angle(original, original, keeps_concave), clamped,
                mean_ridge_angle(original, original, !keeps_concave));
    EXPECT_GT(kept, 0.85 * mean_ridge_angle(original, original, keeps_concave));
    EXPECT_LT(clamped, 0.5 * mean_ridge_angle(original, original, !keeps_concave));
  }
}

// §3.1: the quadratic likelihood follows a far outlier, Huber's lets it go.
TEST(RobustLikelihood, LetsOutliersGo) {
  const Mesh original = test::icosphere(4, 8);
  Mesh noisy = add_noise(original, 0.1, 1, NoiseKind::kGaussian);
  for (std::size_t v = 0; v < noisy.positions.size(); v += 50) noisy.positions[v] *= 1.25;
  const auto error = [&](LikelihoodKind kind) {
    MrfOptions options;
    options.solver = Solver::kMetropolis;
    options.process = Process::kVertex;
    options.edge_process = false;
    options.likelihood = kind;
    options.likelihood_weight = 1;
    options.likelihood_width = 0.15;
    return test::measure_smoothed(noisy, original, options).mean_normal_error_deg;
  };
  const double quadratic = error(LikelihoodKind::kQuadratic), huber = error(LikelihoodKind::kHuber);
  std::printf("  quadratic %.2f deg, huber %.2f\n", quadratic, huber);
  EXPECT_LT(huber, 0.8 * quadratic);
}

// §3.1: a cube smoothed without labels loses its corners, and less volume when neighbourhoods must not sweep any.
TEST(VolumeLikelihood, KeepsTheVolumeOfACube) {
  const Mesh original = test::cube(10);
  const Mesh noisy = add_noise(original, 0.2, 1, NoiseKind::kGaussian);
  const Topology topology = build_topology(noisy);
  const auto change = [&](LikelihoodKind kind) {
    MrfOptions options;
    options.solver = Solver::kMetropolis;
    options.process = Process::kVertex;
    options.edge_process = false;
    options.likelihood = kind;
    RunContext context;
    return std::abs(relative_volume_change(noisy, topology, smooth(noisy, topology, {options}, context).positions));
  };
  const double quadratic = change(LikelihoodKind::kQuadratic), volume = change(LikelihoodKind::kVolume);
  std::printf("  volume change: quadratic %.4f, volume %.4f\n", quadratic, volume);
  EXPECT_LT(volume, 0.5 * quadratic);
}

TEST(PiecewiseQuadraticPrior, BeatsTheFirstOrderPriorOnACylinder) { EXPECT_LT(error_ratio(tube(20, 40)), 0.92); }

TEST(PiecewiseQuadraticPrior, BeatsTheFirstOrderPriorOnAParaboloid) { EXPECT_LT(error_ratio(paraboloid(40, 8)), 0.9); }

}  // namespace
}  // namespace crease
