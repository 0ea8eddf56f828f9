#include "tests/quality/depth_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/mesh/face_vectors.h"
#include "core/mesh/topology.h"
#include "tests/support/meshes.h"

namespace crease::quality {
namespace {

constexpr DepthCamera kCamera{.pixels_across = 80, .distance = 4, .farthest_step = 5};

/// Of the noisy mesh less the original, along the rays, in pixels.
std::vector<double> errors_along_rays(const DepthView& view) {
  std::vector<double> errors;
  for (std::size_t v = 0; v < view.noisy.positions.size(); ++v) {
    errors.push_back((view.noisy.positions[v].z() - view.original.positions[v].z()) * kCamera.pixels_across);
  }
  return errors;
}

double mean_product(const std::vector<double>& errors, const std::vector<Edge>& edges) {
  double sum = 0;
  for (const auto& [a, b] : edges) sum += errors[a] * errors[b];
  return sum / static_cast<double>(edges.size());
}

double mean_square(const std::vector<double>& errors) {
  double sum = 0;
  for (const double error : errors) sum += error * error;
  return sum / static_cast<double>(errors.size());
}

TEST(DepthCamera, SeesTheNearSideOfASphereOnTheGridOfItsPixels) {
  const auto view = take_depth_view(test::icosphere(5), kCamera, {}, 1);
  ASSERT_TRUE(view);
  EXPECT_EQ(view->noisy.positions, view->original.positions);
  EXPECT_EQ(view->noisy.triangles, view->original.triangles);
  // A disc of 80 pixels has π/4 · 80² of them; what is too steep for faces is missing at its rim.
  EXPECT_GT(view->original.positions.size(), 0.9 * 5026);
  EXPECT_LT(view->original.positions.size(), 1.05 * 5026);
  for (const Vec3& p : view->original.positions) {
    EXPECT_NEAR((p - Vec3(0, 0, kCamera.distance)).norm(), 0.5, 2e-3);
    const double column = p.x() / p.z() * kCamera.pixels_across * kCamera.distance;
    EXPECT_NEAR(column, std::round(column), 1e-9);
  }
  for (const Triangle& face : view->original.triangles) {
    EXPECT_LT(area_vector(view->original.positions, face).dot(centroid(view->original.positions, face)), 0);
  }
}

TEST(DepthCamera, NoiseMovesPointsAlongTheirRaysByItsLevel) {
  const DepthNoise noise{.level = 0.5};
  const auto view = take_depth_view(test::icosphere(5), kCamera, noise, 2);
  ASSERT_TRUE(view);
  for (std::size_t v = 0; v < view->original.positions.size(); ++v) {
    EXPECT_LT(view->original.positions[v].cross(view->noisy.positions[v]).norm(), 1e-9);
  }
  const std::vector<double> errors = errors_along_rays(*view);
  EXPECT_NEAR(std::sqrt(mean_square(errors)), 0.5, 0.03);
  const Topology topology = build_topology(view->original);
  EXPECT_LT(std::abs(mean_product(errors, topology.edges)), 0.1 * 0.25);
}

TEST(DepthCamera, SmoothNoiseIsCorrelated) {
  const DepthNoise noise{.level = 0.5, .fine_width = 1.5};
  const auto view = take_depth_view(test::icosphere(5), kCamera, noise, 2);
  ASSERT_TRUE(view);
  const std::vector<double> errors = errors_along_rays(*view);
  // White noise after a Gaussian of width w is correlated by exp(−d²/4w²) over d pixels: 0.89 along rows, 0.80 across.
  const double ratio = mean_product(errors, build_topology(view->original).edges) / mean_square(errors);
  EXPECT_GT(ratio, 0.8);
  EXPECT_LT(ratio, 0.9);
}

TEST(DepthCamera, RoundedDepthsAreMultiplesOfTheStep) {
  DepthNoise noise{.level = 0.5, .step = 0.7};
  const auto rounded = take_depth_view(test::icosphere(5), kCamera, noise, 3);
  ASSERT_TRUE(rounded);
  for (const Vec3& p : rounded->noisy.positions) {
    const double steps = p.z() * kCamera.pixels_across / noise.step;
    EXPECT_NEAR(steps, std::round(steps), 1e-6);
  }
  noise.rounds_disparity = true;
  const auto disparities = take_depth_view(test::icosphere(5), kCamera, noise, 3);
  ASSERT_TRUE(disparities);
  for (const Vec3& p : disparities->noisy.positions) {
    const double steps = kCamera.distance * kCamera.distance / p.z() * kCamera.pixels_across / noise.step;
    EXPECT_NEAR(steps, std::round(steps), 1e-6);
  }
}

TEST(DepthCamera, WhatIsTooSmallIsNoView) { EXPECT_FALSE(take_depth_view(test::cube(2), {.pixels_across = 8}, {}, 1)); }

}  // namespace
}  // namespace crease::quality
