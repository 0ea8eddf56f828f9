#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "core/measure/measure.h"
#include "core/measure/noise.h"
#include "core/smooth/classical/fuzzy_vector_median.h"
#include "core/smooth/classical/methods.h"
#include "core/smooth/smooth.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

const std::vector<Method> kAll{FuzzyVectorMedianOptions{}, TaubinOptions{},          MeanCurvatureFlowOptions{},
                               AnisotropicFlowOptions{},   NormalDiffusionOptions{}, NonIterativeOptions{},
                               BilateralOptions{},         DiebelOptions{}};
static_assert(std::variant_size_v<Method> == 9);  // and the Markov random field

std::string_view name_of(const Method& method) {
  return std::visit([](const auto& options) { return options.kName; }, method);
}

SmoothResult denoise(const Mesh& mesh, const Method& method) {
  RunContext context;
  return smooth(mesh, build_topology(mesh), {method, 1}, context);
}

Mesh denoised(const Mesh& mesh, const Method& method) { return {denoise(mesh, method).positions, mesh.triangles}; }

/// The method with another number of iterations, where it has any.
Method with_iterations(Method method, std::uint32_t iterations) {
  const auto set = [&](auto& options) {
    if constexpr (requires { options.iterations; }) options.iterations = iterations;
  };
  std::visit(set, method);
  return method;
}

Mesh noisy_sphere(int subdivisions = 3) {
  return add_noise(test::icosphere(subdivisions), 0.2, 1, NoiseKind::kGaussian);
}

double largest_distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double largest = 0;
  for (std::size_t v = 0; v < a.size(); ++v) largest = std::max(largest, (a[v] - b[v]).norm());
  return largest;
}

double mean_radius(const Mesh& mesh) {
  double sum = 0;
  for (const Vec3& position : mesh.positions) sum += position.norm();
  return sum / static_cast<double>(mesh.positions.size());
}

double volume_change(const Mesh& before, const Mesh& after) {
  return relative_volume_change(before, build_topology(before), after.positions);
}

/// A grid with randomly placed vertices in the plane through the origin with normal (1, 2, 2).
Mesh tilted_plane() {
  Mesh mesh = test::grid(9, 8);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> amount(-0.2, 0.2);
  const auto tilt = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), Vec3(1, 2, 2));
  for (Vec3& position : mesh.positions) position = tilt * Vec3(position + Vec3(amount(random), amount(random), 0));
  return mesh;
}

/// Three noisy grids that share the y axis like pages of a book, the i-th turned by the i-th angle. Each edge of the
/// spine has three faces.
Mesh book(const std::array<double, 3>& angles) {
  constexpr double kOnSpine = 1e-9;
  const Mesh page = test::grid(6, 6);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> amount(-0.3, 0.3);
  Mesh mesh;
  for (const Vec3& position : page.positions) {
    if (position.x() < kOnSpine) mesh.positions.push_back(position);
  }
  for (const double angle : angles) {
    std::vector<Index> place;
    Index on_spine = 0;
    for (const Vec3& position : page.positions) {
      const bool is_spine = position.x() < kOnSpine;
      place.push_back(is_spine ? on_spine++ : static_cast<Index>(mesh.positions.size()));
      if (is_spine) continue;
      mesh.positions.push_back(Eigen::AngleAxisd(angle, Vec3::UnitY()) * (position + Vec3(0, 0, amount(random))));
    }
    for (const auto& [a, b, c] : page.triangles) mesh.triangles.push_back({place[a], place[b], place[c]});
  }
  return mesh;
}

TEST(Classical, KeepsAPlane) {
  const Mesh plane = tilted_plane();
  for (const Method& method : kAll) {
    for (const Vec3& position : denoised(plane, method).positions) {
      EXPECT_NEAR(position.dot(Vec3(1, 2, 2) / 3), 0, 1e-9) << name_of(method);
    }
  }
}

TEST(Classical, CommutesWithMovingTurningAndScaling) {
  const Mesh mesh = noisy_sphere();
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.8, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const auto transform = [&](std::vector<Vec3> positions) {
    for (Vec3& position : positions) position = 25 * (turn * position) + Vec3(100, -40, 30);
    return positions;
  };
  for (const Method& method : kAll) {
    // Later, rounding may change a decision of the line search of Diebel et al.
    const Method tried = std::holds_alternative<DiebelOptions>(method) ? DiebelOptions{.iterations = 20} : method;
    const Mesh moved{transform(mesh.positions), mesh.triangles};
    EXPECT_LT(largest_distance(denoised(moved, tried).positions, transform(denoised(mesh, tried).positions)), 1e-5)
        << name_of(method);
  }
}

TEST(Classical, BringsANoisySphereCloserToTheSphere) {
  const Mesh sphere = test::icosphere(4), noisy = noisy_sphere(4);
  const double before = measure(sphere, noisy).mean_normal_error_deg;
  for (const Method& method : kAll) {
    EXPECT_LT(measure(sphere, denoised(noisy, method)).mean_normal_error_deg, 0.5 * before) << name_of(method);
  }
}

TEST(Classical, SurvivesEveryMeshAndKeepsItsBoundaries) {
  for (const auto& [name, clean, manifold, closed, degenerate] : test::mesh_family()) {
    for (const Mesh& mesh : {clean, add_noise(clean, 0.4, 1, NoiseKind::kGaussian)}) {
      const Topology topology = build_topology(mesh);
      for (const Method& method : kAll) {
        const std::vector<Vec3> positions = denoise(mesh, method).positions;
        ASSERT_EQ(positions.size(), mesh.positions.size());
        for (std::size_t v = 0; v < positions.size(); ++v) {
          ASSERT_TRUE(positions[v].allFinite()) << name << ", " << name_of(method);
          if (!topology.vertex_edges[v].empty()) continue;
          EXPECT_EQ(positions[v], mesh.positions[v]) << name << ", " << name_of(method);
        }
        for (std::size_t e = 0; e < topology.edges.size(); ++e) {
          if (topology.is_interior(e)) continue;
          const auto [v0, v1] = topology.edges[e];
          EXPECT_EQ(positions[v0], mesh.positions[v0]) << name << ", " << name_of(method);
          EXPECT_EQ(positions[v1], mesh.positions[v1]) << name << ", " << name_of(method);
        }
      }
    }
  }
}

TEST(Classical, SmoothsNothingAcrossNonManifoldEdges) {
  const Mesh one = book({0, 2, 4}), folded_otherwise = book({0, 1.2, 5.5});
  const std::size_t first_page_end = 7 + (one.positions.size() - 7) / 3;
  ASSERT_EQ(one.positions.size(), 7 + 3 * 42U);
  for (const Method& method : kAll) {
    // All pages share one line search of Diebel et al.: compare the minima.
    const Method tried = std::holds_alternative<DiebelOptions>(method)
                             ? DiebelOptions{.iterations = 3000, .likelihood_weight = 8}
                             : method;
    std::vector<Vec3> a = denoised(one, tried).positions;
    std::vector<Vec3> b = denoised(folded_otherwise, tried).positions;
    a.resize(first_page_end);
    b.resize(first_page_end);
    EXPECT_LT(largest_distance(a, b), 1e-6) << name_of(method);
  }
}

TEST(Classical, KeepsMeshesWithoutExtentAndHandlesExtremeScales) {
  Mesh point = test::icosphere(1);
  for (Vec3& position : point.positions) position = Vec3(1, 2, 3);
  for (const Method& method : kAll) {
    EXPECT_EQ(denoised(point, method).positions, point.positions) << name_of(method);
    EXPECT_EQ(denoised(Mesh{{{1, 2, 3}}, {}}, method).positions.size(), 1U) << name_of(method);
    for (const double scale : {1e-200, 1e300, std::numeric_limits<double>::max()}) {
      Mesh mesh = noisy_sphere(2);
      for (Vec3& position : mesh.positions) position *= scale / 2;
      for (const Vec3& position : denoised(mesh, method).positions) {
        EXPECT_TRUE(position.allFinite()) << name_of(method) << " at " << scale;
      }
    }
  }
}

TEST(Classical, GivesTheSameBitsAgain) {
  const Mesh mesh = noisy_sphere();
  for (const Method& method : kAll) {
    EXPECT_EQ(denoised(mesh, method).positions, denoised(mesh, method).positions) << name_of(method);
  }
}

TEST(Classical, StopsWhenTheCallerSaysSo) {
  const Mesh mesh = noisy_sphere();
  const Topology topology = build_topology(mesh);
  for (const Method& method : kAll) {
    const std::uint32_t wanted = std::holds_alternative<NonIterativeOptions>(method) ? 1 : 2;
    std::uint32_t calls = 0;
    RunContext context;
    context.on_sweep = [&](const SweepView& view) {
      EXPECT_EQ(view.record.sweep, ++calls);
      EXPECT_GE(view.sweeps, wanted);
      EXPECT_EQ(view.positions().size(), mesh.positions.size());
      return view.record.sweep < wanted;
    };
    const SmoothResult stopped = smooth(mesh, topology, {method, 1}, context);
    EXPECT_TRUE(stopped.cancelled) << name_of(method);
    EXPECT_EQ(stopped.sweeps.size(), wanted) << name_of(method);
    EXPECT_EQ(calls, wanted) << name_of(method);
    EXPECT_EQ(stopped.positions, denoised(mesh, with_iterations(method, wanted)).positions) << name_of(method);
  }
}

TEST(FuzzyVectorMedian, IgnoresOutliers) {
  const Vec3 outlier = Vec3(1, 1, 0).normalized();
  std::vector<Vec3> normals(3, outlier);
  for (int i = 0; i < 10; ++i) normals.push_back(Vec3(0.05 * std::cos(i), 0.05 * std::sin(i), 1).normalized());
  Vec3 mean = Vec3::Zero();
  for (const Vec3& normal : normals) mean += normal;
  EXPECT_GT((mean.normalized() - Vec3::UnitZ()).norm(), 0.25);
  EXPECT_LT((fuzzy_vector_median(normals, 0.3) - Vec3::UnitZ()).norm(), 0.02);
}

TEST(FuzzyVectorMedian, IsTheMeanForAWideAndTheMedianForANarrowMembership) {
  const std::vector<Vec3> normals{Vec3::UnitX(), Vec3(1, 0.2, 0).normalized(), Vec3::UnitY(), Vec3::Zero()};
  EXPECT_LT((fuzzy_vector_median(normals, 1e6) - (normals[0] + normals[1] + normals[2]).normalized()).norm(), 1e-9);
  EXPECT_LT((fuzzy_vector_median(normals, 1e-3) - normals[1]).norm(), 1e-9);
  EXPECT_EQ(fuzzy_vector_median(std::span(normals).last(1), 0.3), Vec3::Zero());
}

TEST(MeanCurvatureFlow, ShrinksASphereAtTheAnalyticRate) {
  const Mesh sphere = test::icosphere(4);
  const double edge = mean_edge_length(sphere.positions, build_topology(sphere).edges);
  const MeanCurvatureFlowOptions options{.iterations = 10, .step = 1};
  double radius = 1;  // dr/dt = −2/r, by implicit steps over the geometry before each
  for (std::uint32_t i = 0; i < options.iterations; ++i)
    radius /= 1 + 2 * options.step * edge * edge / (radius * radius);
  const double shrunk = 1 - mean_radius(denoised(sphere, options));
  EXPECT_NEAR(shrunk, 1 - radius, 0.02 * (1 - radius));
  EXPECT_NEAR(radius, std::sqrt(1 - 4 * options.iterations * options.step * edge * edge), 0.03 * (1 - radius));
}

TEST(AnisotropicFlow, KeepsRidgesThatMeanCurvatureFlowRounds) {
  const Mesh cube = test::cube(10);
  const double rounded = volume_change(cube, denoised(cube, MeanCurvatureFlowOptions{.iterations = 10, .step = 0.1}));
  EXPECT_LT(rounded, -0.01);
  const AnisotropicFlowOptions anisotropic{.iterations = 10, .step = 0.1, .normal_width = 0.3};
  EXPECT_GT(volume_change(cube, denoised(cube, anisotropic)), 0.02 * rounded);
}

TEST(Taubin, KeepsTheVolumeThatALaplacianLoses) {
  const Mesh sphere = test::icosphere(4);
  EXPECT_LT(std::abs(volume_change(sphere, denoised(sphere, TaubinOptions{.iterations = 30}))), 0.015);
  EXPECT_LT(volume_change(sphere, denoised(sphere, MeanCurvatureFlowOptions{.iterations = 30})), -0.1);
}

TEST(Diebel, EndsWhereNothingIsLeftToGain) {
  const SmoothResult result = denoise(test::icosphere(2), DiebelOptions{.iterations = 100'000, .likelihood_weight = 8});
  EXPECT_LT(result.sweeps.size(), 10'000U);
  EXPECT_FALSE(result.cancelled);
}

}  // namespace
}  // namespace crease
