#include "tests/quality/noise_models.h"

#include <fmt/format.h>

#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

#include "core/measure/noise.h"
#include "core/mesh/face_vectors.h"
#include "core/mesh/topology.h"

namespace crease::quality {
namespace {

/// Deviation at the noisy end of the mesh relative to the quiet one.
constexpr double kGrowth = 8;

/// Steps of averaging. Each mixes a vertex with the mean of its neighbours in equal parts, a random walk of step 1 edge
/// and probability 1/2; 16 of them correlate vertices over about 4 edges.
constexpr int kLowPassSteps = 16;

Mesh add_growing_noise(const Mesh& mesh, double level, std::uint64_t seed) {
  Vec3 low = mesh.positions.front(), high = low;
  for (const Vec3& position : mesh.positions) {
    low = low.cwiseMin(position);
    high = high.cwiseMax(position);
  }
  Eigen::Index axis = 0;
  const double length = (high - low).maxCoeff(&axis);
  Mesh noisy = add_noise(mesh, level, seed, NoiseKind::kNormal);
  for (std::size_t v = 0; v < noisy.positions.size(); ++v) {
    const double share = length > 0 ? (mesh.positions[v][axis] - low[axis]) / length : 0.5;
    const double factor = 2 * (1 + (kGrowth - 1) * share) / (1 + kGrowth);
    noisy.positions[v] = mesh.positions[v] + factor * (noisy.positions[v] - mesh.positions[v]);
  }
  return noisy;
}

/// Keeps the noise of a random tenth of the vertices.
Mesh add_sparse_noise(const Mesh& mesh, double level, std::uint64_t seed) {
  constexpr double kMoved = 0.1;
  Mesh noisy = add_noise(mesh, level, seed, NoiseKind::kNormal);
  std::mt19937_64 random(seed);
  std::bernoulli_distribution is_moved(kMoved);
  for (std::size_t v = 0; v < noisy.positions.size(); ++v) {
    if (!is_moved(random)) noisy.positions[v] = mesh.positions[v];
  }
  return noisy;
}

void average_with_neighbors(const Topology& topology, std::vector<double>& values) {
  std::vector<double> averaged = values;
  for (std::size_t v = 0; v < values.size(); ++v) {
    const auto edges = topology.vertex_edges[v];
    if (edges.empty()) continue;
    double sum = 0;
    for (const Index edge : edges) sum += values[other_end(topology.edges[edge], static_cast<Index>(v))];
    averaged[v] = (values[v] + sum / static_cast<double>(edges.size())) / 2;
  }
  values.swap(averaged);
}

Mesh add_correlated_noise(const Mesh& mesh, double level, std::uint64_t seed) {
  const Topology topology = build_topology(mesh);
  const Mesh white = add_noise(mesh, 1, seed, NoiseKind::kGaussian);
  std::vector<double> heights;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    heights.push_back(white.positions[v].x() - mesh.positions[v].x());
  }
  for (int step = 0; step < kLowPassSteps; ++step) average_with_neighbors(topology, heights);
  double squares = 0;
  for (const double height : heights) squares += height * height;
  const double deviation = std::sqrt(squares / static_cast<double>(heights.size()));
  const double scale = deviation > 0 ? level * mean_edge_length(mesh.positions, topology.edges) / deviation : 0;
  const std::vector<Vec3> normals = unit_vertex_normals(mesh, topology);
  Mesh noisy = mesh;
  for (std::size_t v = 0; v < heights.size(); ++v) noisy.positions[v] += scale * heights[v] * normals[v];
  return noisy;
}

}  // namespace

std::vector<Vec3> unit_vertex_normals(const Mesh& mesh, const Topology& topology) {
  std::vector<Vec3> normals(mesh.positions.size(), Vec3::Zero());
  for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
    const Triangle corners = oriented(mesh, topology, face);
    for (const Index vertex : corners) normals[vertex] += area_vector(mesh.positions, corners);
  }
  for (Vec3& normal : normals) normal = direction(normal);
  return normals;
}

std::string_view word_of(Noise kind) { return words_of(kind)[static_cast<std::size_t>(kind)]; }

Mesh add_noise_of_kind(const Mesh& mesh, Noise kind, double level, std::uint64_t seed) {
  if (level == 0) return mesh;
  switch (kind) {
    case Noise::kNormal:
      return add_noise(mesh, level, seed, NoiseKind::kNormal);
    case Noise::kIsotropic:
      return add_noise(mesh, level, seed, NoiseKind::kGaussian);
    case Noise::kImpulsive:
      return add_noise(mesh, level, seed, NoiseKind::kImpulsive);
    case Noise::kSparse:
      return add_sparse_noise(mesh, level, seed);
    case Noise::kGrowing:
      return add_growing_noise(mesh, level, seed);
    case Noise::kCorrelated:
      return add_correlated_noise(mesh, level, seed);
    case Noise::kDepth:
    case Noise::kFused:
    case Noise::kMeasured:
      break;
  }
  throw std::invalid_argument(fmt::format("{} noise is not added to a mesh", word_of(kind)));
}

}  // namespace crease::quality
