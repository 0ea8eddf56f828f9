#include "core/mesh/noise_estimate.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/mesh/face_vectors.h"
#include "core/mesh/pooled_variance.h"

namespace crease {
namespace {

constexpr std::size_t kMaxSamples = 20'000, kSamplesATime = 64;
constexpr std::size_t kMaxNeighbours = 60;
constexpr std::size_t kMaxValence = 32;
constexpr Eigen::Index kMinFreedom = 4;

struct Fit {
  FitVariance noise;         ///< in squared units of length
  double planar_length = 0;  ///< mean length of the vertex's edges within the plane
};

/// Hubs of very many edges are left alone: there the two-ring is no neighbourhood, and walking it over and over would
/// take quadratic time.
bool has_hub(const Topology& topology, Index vertex) {
  if (topology.vertex_edges[vertex].size() > kMaxValence) return true;
  return std::any_of(topology.vertex_edges[vertex].begin(), topology.vertex_edges[vertex].end(), [&](Index edge) {
    return topology.vertex_edges[other_end(topology.edges[edge], vertex)].size() > kMaxValence;
  });
}

/// The vertices up to two edges away, the vertex itself first.
std::vector<Index> two_ring(const Topology& topology, Index vertex) {
  std::vector<Index> ring = {vertex};
  const auto add_neighbours = [&](Index of) {
    for (const Index edge : topology.vertex_edges[of]) {
      const auto [v0, v1] = topology.edges[edge];
      const Index other = v0 == of ? v1 : v0;
      if (ring.size() <= kMaxNeighbours && std::find(ring.begin(), ring.end(), other) == ring.end()) {
        ring.push_back(other);
      }
    }
  };
  add_neighbours(vertex);
  const std::size_t first_ring_end = ring.size();
  for (std::size_t i = 1; i < first_ring_end; ++i) add_neighbours(ring[i]);
  return ring;
}

/// Sum of the area vectors of the faces at the vertex and its neighbours. It depends on the border of the patch only,
/// so that noise hardly turns it.
Vec3 vector_area(const Mesh& mesh, const Topology& topology, Index vertex) {
  Vec3 sum = Vec3::Zero();
  const auto add_faces = [&](Index of) {
    for (const Index face : topology.vertex_faces[of]) {
      sum += area_vector(mesh.positions, oriented(mesh, topology, face));
    }
  };
  add_faces(vertex);
  for (const Index edge : topology.vertex_edges[vertex]) add_faces(other_end(topology.edges[edge], vertex));
  return sum;
}

/// Lengths come out in units of `length_unit`, which keeps the powers in the quadric near one.
std::optional<Fit> fit_quadric(const Mesh& mesh, const Topology& topology, Index vertex, double length_unit) {
  if (has_hub(topology, vertex)) return std::nullopt;
  const std::vector<Index> ring = two_ring(topology, vertex);
  const auto count = static_cast<Eigen::Index>(ring.size());
  if (count < 6 + kMinFreedom) return std::nullopt;
  const Vec3 normal = vector_area(mesh, topology, vertex).stableNormalized();
  if (normal.isZero(0)) return std::nullopt;
  const Vec3 right = normal.unitOrthogonal(), up = normal.cross(right);

  Eigen::MatrixXd terms(count, 6);
  Eigen::VectorXd heights(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Vec3 offset = (mesh.positions[ring[static_cast<std::size_t>(i)]] - mesh.positions[vertex]) / length_unit;
    const double x = offset.dot(right), y = offset.dot(up);
    terms.row(i) << 1, x, y, x * x, x * y, y * y;
    heights[i] = offset.dot(normal);
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors(terms);
  const Eigen::Index freedom = count - factors.rank();
  const double squares = (heights - terms * factors.solve(heights)).squaredNorm();

  Fit fit{{squares / static_cast<double>(freedom), static_cast<double>(freedom)}, 0};
  const auto degree = static_cast<Eigen::Index>(topology.vertex_edges[vertex].size());
  for (Eigen::Index i = 1; i <= degree; ++i) fit.planar_length += std::hypot(terms(i, 1), terms(i, 2));
  fit.planar_length /= static_cast<double>(degree);
  return fit;
}

}  // namespace

double estimate_noise_sigma(const Mesh& mesh, const Topology& topology, ThreadTeam& team) {
  const double length_unit = mean_edge_length(mesh.positions, topology.edges);
  const std::size_t vertex_count = mesh.positions.size();
  const std::size_t stride = std::max<std::size_t>(1, (vertex_count + kMaxSamples - 1) / kMaxSamples);
  std::vector<std::optional<Fit>> samples((vertex_count + stride - 1) / stride);
  team.run(samples.size(), kSamplesATime, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      samples[i] = fit_quadric(mesh, topology, static_cast<Index>(i * stride), length_unit);
    }
  });
  std::vector<FitVariance> fits;
  double planar_length = 0;
  for (const std::optional<Fit>& fit : samples) {
    if (!fit) continue;
    fits.push_back(fit->noise);
    planar_length += fit->planar_length;
  }
  if (!(planar_length > 0)) return 0;
  return std::sqrt(pooled_variance(fits)) / (planar_length / static_cast<double>(fits.size()));
}

}  // namespace crease
