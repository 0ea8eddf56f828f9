#include "core/graduated/sampling.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdint>

#include "core/geometry/surface.h"
#include "core/graduated/descent.h"
#include "core/measure/noise.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

FlatVectors unit_normals(const FlatMesh& mesh, std::span<const float> positions) {
  const std::size_t count = mesh.vertex_count;
  FlatVectors normals(3 * count, 0);
  for (std::size_t v = 0; v < count; ++v) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (const Index place : mesh.vertex_corners[v]) {
      const auto area = area_vector(mesh, positions, place / 3);
      sum += Eigen::Vector3f(area[0], area[1], area[2]);
    }
    sum.normalize();
    for (Eigen::Index axis = 0; axis < 3; ++axis) normals[static_cast<std::size_t>(axis) * count + v] = sum[axis];
  }
  return normals;
}

/// The least squares of evening_moves, by a dense factorisation.
Eigen::VectorXd expected_moves(const SamplingView& view, double ratio) {
  const FlatMesh& mesh = view.mesh;
  const auto count = static_cast<Eigen::Index>(mesh.vertex_count);
  Eigen::MatrixXd tangents = Eigen::MatrixXd::Zero(3 * count, 2 * count),
                  means = Eigen::MatrixXd::Zero(3 * count, 3 * count);
  for (Eigen::Index v = 0; v < count; ++v) {
    const auto n = vector_at(view.normals, static_cast<std::size_t>(v));
    const Eigen::Vector3d normal(n[0], n[1], n[2]), right = normal.unitOrthogonal(), up = normal.cross(right);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      tangents(axis * count + v, 2 * v) = right[axis];
      tangents(axis * count + v, 2 * v + 1) = up[axis];
    }
    if (mesh.at_border[static_cast<std::size_t>(v)] != 0) continue;
    const auto& neighbors = mesh.vertex_neighbors[static_cast<std::size_t>(v)];
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      means(axis * count + v, axis * count + v) = -1;
      for (const Index other : neighbors) {
        means(axis * count + v, axis * count + static_cast<Eigen::Index>(other)) =
            1.0 / static_cast<double>(neighbors.size());
      }
    }
  }
  const auto vector = [](std::span<const float> flat) {
    return Eigen::Map<const Eigen::VectorXf>(flat.data(), static_cast<Eigen::Index>(flat.size())).cast<double>().eval();
  };
  const Eigen::MatrixXd within = tangents.transpose() * means * tangents;
  const Eigen::VectorXd to_measured = tangents.transpose() * (vector(view.measured) - vector(view.positions)),
                        to_means = tangents.transpose() * means * vector(view.positions);
  const Eigen::MatrixXd normal_matrix =
      Eigen::MatrixXd::Identity(2 * count, 2 * count) + ratio * within.transpose() * within;
  return tangents * normal_matrix.ldlt().solve(to_measured - ratio * within.transpose() * to_means);
}

TEST(Sampling, MovesAreThoseOfLeastSquares) {
  for (const Mesh& original : {test::icosphere(2), test::grid(8, 8)}) {
    const Mesh noisy = add_noise(original, 0.3, 1, NoiseKind::kGaussian);
    const Topology topology = build_topology(noisy);
    const Surface surface(noisy, topology);
    const FlatMesh mesh(surface);
    FlatVectors positions = mesh.measured;
    for (std::size_t i = 0; i < positions.size(); ++i) positions[i] += 0.05F * std::sin(static_cast<float>(i));
    const FlatVectors normals = unit_normals(mesh, positions);
    const SamplingView view{mesh, positions, mesh.measured, normals};
    ThreadTeam alone(1);
    const FlatVectors moves = evening_moves(view, 2, alone);
    const Eigen::VectorXd expected = expected_moves(view, 2);
    for (std::size_t i = 0; i < moves.size(); ++i) {
      EXPECT_NEAR(moves[i], expected[static_cast<Eigen::Index>(i)], 0.01) << i;
    }
  }
}

TEST(Sampling, AnyNumberOfThreadsGivesTheSameBits) {
  const Mesh noisy = add_noise(test::icosphere(5), 0.3, 1, NoiseKind::kGaussian);
  const Topology topology = build_topology(noisy);
  const Surface surface(noisy, topology);
  const FlatMesh mesh(surface);
  const FlatVectors normals = unit_normals(mesh, mesh.measured);
  const SamplingView view{mesh, mesh.measured, mesh.measured, normals};
  ThreadTeam alone(1), three(3);
  EXPECT_EQ(evening_moves(view, 11, alone), evening_moves(view, 11, three));
}

double mean_distance(const FlatMesh& original, const FlatVectors& positions) {
  const FlatVectors off = difference(positions, original.measured);
  double sum = 0;
  for (const float square : products(off, off)) sum += std::sqrt(static_cast<double>(square));
  return sum / static_cast<double>(original.vertex_count);
}

/// Noise within the surface of a regular mesh is mostly taken back; without a smooth sampling in mind it all stays.
TEST(Sampling, ADescentTakesBackNoiseWithinTheSurface) {
  const Mesh original = test::icosphere(4), noisy = add_noise(original, 0.3, 1, NoiseKind::kGaussian);
  const Topology topology = build_topology(noisy);
  const Surface surface(noisy, topology);
  const FlatMesh mesh(surface);
  std::vector<Vec3> places;
  for (const Vec3& position : original.positions) places.push_back((position - surface.origin) / surface.unit);
  const FlatMesh truth(topology, surface.faces, places);
  ThreadTeam alone(1);
  const auto error = [&](float irregularity) {
    GraduatedOptions options;
    options.across = 1;
    options.irregularity = irregularity;
    return mean_distance(truth, GraduatedDescent(mesh, mesh.measured, options, {}, {}, alone).run().positions);
  };
  EXPECT_LT(error(0.15F), 0.5 * error(0));
}

}  // namespace
}  // namespace crease
