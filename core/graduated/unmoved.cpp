#include "core/graduated/unmoved.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/graduated/latent_variance.h"

namespace crease {
namespace {

constexpr double kFarApart = 100;     ///< the variance of the noise, over that of what it leaves alone
constexpr double kLeastSmall = 1e-8;  ///< of the latter, in ℓ²
constexpr int kRoundsBetween = 30;    ///< of averaging between vertices that were put back

/// The way of each vertex to where it was measured, along the normal there.
std::vector<float> residuals_of(const FlatMesh& mesh, const FlatVectors& positions, const FlatVectors& ways,
                                ThreadTeam& team) {
  std::vector<float> residuals(mesh.vertex_count);
  for_each(mesh.vertex_count, team, [&](std::size_t v) {
    std::array<float, 3> sum{};
    for (const Index place : mesh.vertex_corners[v]) {
      const auto area = area_vector(mesh, positions, place / 3);
      for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += area[axis];
    }
    const auto way = vector_at(ways, v);
    const float length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    residuals[v] = length > 0 ? (way[0] * sum[0] + way[1] * sum[1] + way[2] * sum[2]) / length : 0;
  });
  return residuals;
}

/// Per vertex: how probably the noise left it alone. Empty where it spares none.
std::vector<float> unmoved_shares(std::span<const float> residuals) {
  const LatentVariance latent = fit_latent_variance(residuals, kLeastSmall);
  if (!latent.impulsive || latent.large_variance < kFarApart * latent.small_variance) return {};
  double mean = 0;
  for (const float residual : residuals) mean += static_cast<double>(residual * residual);
  mean /= static_cast<double>(residuals.size());
  std::vector<float> shares;
  for (const float relative : latent.relative_variance) {
    const double share = (latent.large_variance - mean * static_cast<double>(relative)) /
                         (latent.large_variance - latent.small_variance);
    shares.push_back(static_cast<float>(std::clamp(share, 0.0, 1.0)));
  }
  return shares;
}

}  // namespace

FlatVectors with_unmoved_put_back(const FlatMesh& mesh, const FlatVectors& positions, std::span<const float> measured,
                                  float amount, ThreadTeam& team) {
  const FlatVectors ways = difference(measured, positions);
  const std::vector<float> shares = unmoved_shares(residuals_of(mesh, positions, ways, team));
  if (shares.empty()) return positions;
  const std::size_t count = mesh.vertex_count;
  FlatVectors moves(3 * count, 0);
  for (int round = 0; round < kRoundsBetween; ++round) {
    const FlatVectors before = moves;
    for_each(count, team, [&](std::size_t v) {
      const auto neighbors = mesh.vertex_neighbors[v];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        float mean = 0;
        for (const Index other : neighbors) mean += before[axis * count + other];
        mean /= static_cast<float>(std::max<std::size_t>(1, neighbors.size()));
        moves[axis * count + v] = shares[v] * ways[axis * count + v] + (1 - shares[v]) * mean;
      }
    });
  }
  FlatVectors result = positions;
  for (std::size_t i = 0; i < result.size(); ++i) result[i] += amount * moves[i];
  return result;
}

}  // namespace crease
