#include "core/graduated/unmoved.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>

#include "core/geometry/surface.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

/// A sphere, and the way out of it at each vertex.
struct Sphere {
  Mesh mesh = test::icosphere(5);
  Topology topology = build_topology(mesh);
  Surface surface{mesh, topology};
  FlatMesh flat{surface};

  float outwards(std::size_t i) const {
    const std::size_t v = i % flat.vertex_count;
    return static_cast<float>(mesh.positions[v][static_cast<Eigen::Index>(i / flat.vertex_count)]);
  }

  /// The sphere with each vertex as far out as `height` says, in ℓ.
  FlatVectors with(const std::vector<float>& height) const {
    FlatVectors moved = flat.measured;
    for (std::size_t i = 0; i < moved.size(); ++i) moved[i] += outwards(i) * height[i % flat.vertex_count];
    return moved;
  }
};

std::vector<float> impulses(std::size_t count, double share, std::mt19937_64& random) {
  std::normal_distribution<float> normal(0, 0.3F);
  std::bernoulli_distribution is_moved(share);
  std::vector<float> heights(count);
  for (float& height : heights) height = is_moved(random) ? normal(random) : 0;
  return heights;
}

/// A surface that is smoothed too much, by a wave of some ten edges.
std::vector<float> wave(const Sphere& sphere) {
  std::vector<float> heights;
  for (const Vec3& position : sphere.mesh.positions) {
    heights.push_back(static_cast<float>(0.02 * std::sin(6 * position.x()) * std::cos(6 * position.y())));
  }
  return heights;
}

double mean_distance(const FlatVectors& a, const FlatVectors& b) {
  const FlatVectors off = difference(a, b);
  double sum = 0;
  for (const float square : products(off, off)) sum += std::sqrt(static_cast<double>(square));
  return 3 * sum / static_cast<double>(a.size());
}

TEST(Unmoved, WhatImpulsesLeftAloneTellsTheRestHowItWasSmoothed) {
  const Sphere sphere;
  for (const double share : {0.1, 0.5}) {
    std::mt19937_64 random(1);
    const FlatVectors measured = sphere.with(impulses(sphere.flat.vertex_count, share, random)),
                      smoothed = sphere.with(wave(sphere));
    ThreadTeam alone(1), three(3);
    const FlatVectors result = with_unmoved_put_back(sphere.flat, smoothed, measured, 1, alone);
    const double before = mean_distance(smoothed, sphere.flat.measured),
                 after = mean_distance(result, sphere.flat.measured);
    EXPECT_LT(after, 0.4 * before) << share;
    EXPECT_EQ(result, with_unmoved_put_back(sphere.flat, smoothed, measured, 1, three));
    const double halfway =
        mean_distance(with_unmoved_put_back(sphere.flat, smoothed, measured, 0.5F, alone), sphere.flat.measured);
    EXPECT_GT(halfway, after);
    EXPECT_LT(halfway, before);
  }
}

TEST(Unmoved, NoiseThatSparesNoVertexStaysRemoved) {
  const Sphere sphere;
  std::mt19937_64 random(1);
  std::normal_distribution<float> weak(0, 0.1F), strong(0, 0.4F);
  std::vector<float> even, of_two_strengths;
  for (std::size_t v = 0; v < sphere.flat.vertex_count; ++v) {
    even.push_back(strong(random));
    of_two_strengths.push_back(v % 2 == 0 ? weak(random) : strong(random));
  }
  ThreadTeam alone(1);
  for (const auto& heights : {even, of_two_strengths}) {
    EXPECT_EQ(with_unmoved_put_back(sphere.flat, sphere.flat.measured, sphere.with(heights), 1, alone),
              sphere.flat.measured);
  }
}

}  // namespace
}  // namespace crease
