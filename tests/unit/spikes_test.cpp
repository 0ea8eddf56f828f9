#include "core/choice/spikes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/measure/noise.h"
#include "core/smooth/smooth.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

std::vector<Index> spikes_of(const Mesh& mesh) { return find_spikes(mesh, build_topology(mesh)); }

double edge_length(const Mesh& mesh) { return mean_edge_length(mesh.positions, build_topology(mesh).edges); }

/// Vertices far from each other, by the order of the mesh.
std::vector<Index> every(std::size_t step, const Mesh& mesh) {
  std::vector<Index> vertices;
  for (std::size_t v = step / 2; v < mesh.positions.size(); v += step) vertices.push_back(static_cast<Index>(v));
  return vertices;
}

/// Moves vertices of a surface around the origin outwards, by so many mean edge lengths.
Mesh with_spikes(Mesh mesh, const std::vector<Index>& vertices, double height) {
  const double unit = edge_length(mesh);
  for (const Index v : vertices) mesh.positions[v] += height * unit * mesh.positions[v].normalized();
  return mesh;
}

Mesh noisy_sphere() { return add_noise(test::icosphere(4), 0.1, 1, NoiseKind::kNormal); }

TEST(Spikes, AreFoundWhateverTheirHeight) {
  const Mesh sphere = noisy_sphere();
  const std::vector<Index> vertices = every(211, sphere);
  for (const double height : {1.5, 3.0, 10.0, 100.0}) {
    EXPECT_EQ(spikes_of(with_spikes(sphere, vertices, height)), vertices) << height;
    EXPECT_EQ(spikes_of(with_spikes(sphere, vertices, -height)), vertices) << -height;
  }
}

TEST(Spikes, AreFoundInAnyPlaceAndSize) {
  Mesh mesh = with_spikes(noisy_sphere(), every(211, noisy_sphere()), 3);
  const std::vector<Index> before = spikes_of(mesh);
  for (Vec3& position : mesh.positions) position = 1e-6 * position + Vec3(5, -7, 11);
  EXPECT_EQ(spikes_of(mesh), before);
}

TEST(Spikes, NoiseHasNone) {
  for (const double sigma : {0.1, 0.3, 0.6}) {
    for (const NoiseKind kind : {NoiseKind::kNormal, NoiseKind::kGaussian}) {
      const std::size_t count = spikes_of(add_noise(test::cube(24), sigma, 1, kind)).size();
      EXPECT_LE(count, 1U) << sigma;
    }
  }
}

TEST(Spikes, CornersAndTipsAreShape) {
  for (const auto& member : test::mesh_family()) EXPECT_TRUE(spikes_of(member.mesh).empty()) << member.name;
  Mesh cone = test::cylinder(16, 24, 1, 4);
  for (Vec3& position : cone.positions) position.head<2>() *= (4 - position.z()) / 4 + 1e-3;
  EXPECT_TRUE(spikes_of(cone).empty());
}

TEST(Spikes, ManyAreNoise) {
  const Mesh sphere = noisy_sphere();
  EXPECT_TRUE(spikes_of(with_spikes(sphere, every(31, sphere), 3)).empty());
}

TEST(Spikes, OfAMeshWithoutNoiseAreShape) {
  Mesh mesh = with_spikes(test::icosphere(4), every(211, noisy_sphere()), 3);
  const std::vector<Vec3> before = mesh.positions;
  EXPECT_EQ(flatten_spikes(mesh, build_topology(mesh)), 0U);
  EXPECT_EQ(mesh.positions, before);
}

TEST(Spikes, AreGoneFromTheResultAndItsRidges) {
  const Mesh original = test::cube(16);
  const Topology topology = build_topology(original);
  const std::vector<Index> spikes = every(101, original);
  const double unit = edge_length(original);
  Mesh noisy = add_noise(original, 0.1, 1, NoiseKind::kNormal);
  const Vec3 middle(0.5, 0.5, 0.5);
  for (const Index v : spikes) noisy.positions[v] += 3 * unit * (noisy.positions[v] - middle).normalized();

  RunContext context;
  const SmoothResult result = smooth(noisy, topology, {}, context);
  ASSERT_TRUE(result.choice);
  EXPECT_EQ(result.choice->spikes, spikes.size());
  for (const Index v : spikes) {
    EXPECT_LT((result.positions[v] - original.positions[v]).norm(), 0.75 * unit) << v;
    for (const Index e : topology.vertex_edges[v]) {
      const Edge& edge = topology.edges[e];
      const Vec3 offset = (original.positions[edge.v0] + original.positions[edge.v1]) / 2 - middle;
      const bool near_ridge = (offset.cwiseAbs().array() > 0.5 - 1.5 * unit).count() > 1;
      if (!near_ridge) {
        EXPECT_LT(result.labels[e], kRidgeThreshold) << v;
      }
    }
  }
}

TEST(Spikes, StayWhereTheUploadHasWeights) {
  const Mesh sphere = noisy_sphere();
  const Mesh mesh = with_spikes(sphere, every(211, sphere), 3);
  RunContext context;
  const std::vector<double> weights(mesh.positions.size(), 1);
  const SmoothResult result = smooth(mesh, build_topology(mesh), {}, context, weights);
  ASSERT_TRUE(result.choice);
  EXPECT_EQ(result.choice->spikes, 0U);
}

}  // namespace
}  // namespace crease
