#include "core/measure/noise.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/mesh/topology.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

double length_unit(const Mesh& mesh) { return mean_edge_length(mesh.positions, build_topology(mesh).edges); }

struct Moments {
  double mean = 0, deviation = 0, kurtosis = 0;
};

Moments moments(const std::vector<double>& samples) {
  const auto count = static_cast<double>(samples.size());
  double sum = 0, squares = 0, fourths = 0;
  for (const double x : samples) sum += x;
  const double mean = sum / count;
  for (const double x : samples) {
    squares += std::pow(x - mean, 2);
    fourths += std::pow(x - mean, 4);
  }
  const double variance = squares / count;
  return {mean, std::sqrt(variance), fourths / count / (variance * variance)};
}

/// A cube whose faces share no vertices, as files for rendering have it: it must not be torn apart.
TEST(Noise, CoincidentVerticesMoveAsTheVertexThatTheyStandFor) {
  const Mesh whole = test::cube(3);
  Mesh soup;
  std::vector<Index> vertex_of;
  for (const Triangle& face : whole.triangles) {
    const auto first = static_cast<Index>(soup.positions.size());
    for (const Index vertex : face) {
      soup.positions.push_back(whole.positions[vertex]);
      vertex_of.push_back(vertex);
    }
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  for (const NoiseKind kind : {NoiseKind::kGaussian, NoiseKind::kNormal, NoiseKind::kImpulsive}) {
    const Mesh noisy = add_noise(soup, 0.3, 5, kind);
    std::vector<Vec3> moved(whole.positions.size(), Vec3::Constant(std::nan("")));
    bool any = false;
    for (std::size_t v = 0; v < soup.positions.size(); ++v) {
      Vec3& place = moved[vertex_of[v]];
      if (place.hasNaN()) place = noisy.positions[v];
      EXPECT_EQ(noisy.positions[v], place);
      any = any || place != soup.positions[v];
    }
    EXPECT_TRUE(any);
  }
}

TEST(Noise, EveryKindHasAName) {
  EXPECT_EQ(noise_kind_from_name("gaussian"), NoiseKind::kGaussian);
  EXPECT_EQ(noise_kind_from_name("normal"), NoiseKind::kNormal);
  EXPECT_EQ(noise_kind_from_name("impulsive"), NoiseKind::kImpulsive);
  try {
    noise_kind_from_name("pink");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code::kParameterInvalid);
    EXPECT_EQ(error.value(), "pink");
  }
}

TEST(Noise, GaussianNoiseIsIsotropicWithTheGivenDeviation) {
  const Mesh mesh = test::icosphere(5, 3.0);
  const Mesh noisy = add_noise(mesh, 0.4, 7, NoiseKind::kGaussian);
  const double unit = length_unit(mesh);
  std::array<std::vector<double>, 3> coordinates;
  double product_xy = 0, product_xz = 0;
  for (std::size_t vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    const Vec3 offset = (noisy.positions[vertex] - mesh.positions[vertex]) / unit;
    for (int k = 0; k < 3; ++k) coordinates[static_cast<std::size_t>(k)].push_back(offset[k]);
    product_xy += offset.x() * offset.y();
    product_xz += offset.x() * offset.z();
  }
  const auto count = static_cast<double>(mesh.positions.size());
  const double four_errors = 4 / std::sqrt(count);
  for (const auto& samples : coordinates) {
    const Moments m = moments(samples);
    EXPECT_NEAR(m.mean, 0, 0.4 * four_errors);
    EXPECT_NEAR(m.deviation, 0.4, 0.4 * four_errors);
    EXPECT_NEAR(m.kurtosis, 3, 5 * four_errors);
  }
  EXPECT_NEAR(product_xy / count, 0, 0.16 * four_errors);
  EXPECT_NEAR(product_xz / count, 0, 0.16 * four_errors);
}

TEST(Noise, NormalNoiseMovesAlongVertexNormals) {
  const Mesh mesh = test::icosphere(5);
  const Mesh noisy = add_noise(mesh, 0.3, 1, NoiseKind::kNormal);
  const double unit = length_unit(mesh);
  std::vector<double> heights;
  for (std::size_t vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    const Vec3 normal = mesh.positions[vertex].normalized();
    const Vec3 offset = (noisy.positions[vertex] - mesh.positions[vertex]) / unit;
    heights.push_back(offset.dot(normal));
    EXPECT_LT((offset - heights.back() * normal).norm(), 0.02 * std::abs(heights.back()) + 1e-12);
  }
  EXPECT_NEAR(moments(heights).deviation, 0.3, 0.02);
}

TEST(Noise, ImpulsiveNoiseMovesHalfOfTheVertices) {
  const Mesh mesh = test::icosphere(5);
  const Mesh noisy = add_noise(mesh, 0.5, 3, NoiseKind::kImpulsive);
  const double unit = length_unit(mesh);
  std::vector<double> moved;
  for (std::size_t vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    const Vec3 offset = noisy.positions[vertex] - mesh.positions[vertex];
    if (!offset.isZero(0)) moved.push_back(offset.dot(mesh.positions[vertex].normalized()) / unit);
  }
  const double share = static_cast<double>(moved.size()) / static_cast<double>(mesh.positions.size());
  EXPECT_NEAR(share, 0.5, 0.02);
  EXPECT_NEAR(moments(moved).deviation, 0.5, 0.03);
}

TEST(Noise, DependsOnTheSeedAlone) {
  const Mesh mesh = test::cube(6);
  for (const NoiseKind kind : {NoiseKind::kGaussian, NoiseKind::kNormal, NoiseKind::kImpulsive}) {
    const Mesh first = add_noise(mesh, 0.2, 42, kind);
    EXPECT_EQ(first.positions, add_noise(mesh, 0.2, 42, kind).positions);
    EXPECT_NE(first.positions, add_noise(mesh, 0.2, 43, kind).positions);
    EXPECT_NE(first.positions, add_noise(mesh, 0.2, 42 + (std::uint64_t{1} << 32), kind).positions);
  }
}

TEST(Noise, ScalesWithTheMesh) {
  Mesh mesh = test::cylinder(24, 8, 1, 2);
  const Mesh noisy = add_noise(mesh, 0.3, 5, NoiseKind::kNormal);
  for (Vec3& position : mesh.positions) position *= 1024;
  const Mesh scaled = add_noise(mesh, 0.3, 5, NoiseKind::kNormal);
  for (std::size_t vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    EXPECT_LT((scaled.positions[vertex] / 1024 - noisy.positions[vertex]).norm(), 1e-12);
  }
}

TEST(Noise, KeepsFacesAndStaysFiniteOverTheFamily) {
  for (const auto& member : test::mesh_family()) {
    SCOPED_TRACE(member.name);
    for (const NoiseKind kind : {NoiseKind::kGaussian, NoiseKind::kNormal, NoiseKind::kImpulsive}) {
      const Mesh noisy = add_noise(member.mesh, 0.3, 1, kind);
      EXPECT_EQ(noisy.triangles, member.mesh.triangles);
      for (const Vec3& position : noisy.positions) EXPECT_TRUE(position.allFinite());
      EXPECT_NE(noisy.positions, member.mesh.positions);
      EXPECT_EQ(add_noise(member.mesh, 0, 1, kind).positions, member.mesh.positions);
    }
  }
}

TEST(Noise, RefusesInvalidDeviations) {
  for (const double sigma : {-0.1, std::numeric_limits<double>::infinity(), std::nan("")}) {
    try {
      add_noise(test::cube(2), sigma, 1, NoiseKind::kNormal);
      FAIL() << sigma;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), code::kParameterOutOfRange);
      EXPECT_EQ(error.field(), "sigma");
    }
  }
}

}  // namespace
}  // namespace crease
