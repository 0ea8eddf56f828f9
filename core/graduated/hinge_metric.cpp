#include "core/graduated/hinge_metric.h"

#include <algorithm>
#include <cmath>

namespace crease {
namespace {

/// The vertices of an edge's hinge: opposite, opposite, end, end.
std::array<Index, 4> hinge(const FlatMesh& mesh, std::size_t e) {
  return {static_cast<Index>(mesh.edge_opposites[0][e]), static_cast<Index>(mesh.edge_opposites[1][e]),
          static_cast<Index>(mesh.edge_ends[0][e]), static_cast<Index>(mesh.edge_ends[1][e])};
}

/// Zeros where the matrix of a metric has its entries.
LowerTriangle pattern_of(const FlatMesh& mesh) {
  using Entry = Eigen::Triplet<double>;
  std::vector<Entry> entries;
  const auto add = [&](Index i, Index j) {
    entries.emplace_back(static_cast<int>(std::max(i, j)), static_cast<int>(std::min(i, j)), 0.0);
  };
  for (Index v = 0; v < mesh.vertex_count; ++v) add(v, v);
  for (std::size_t e = 0; e < mesh.edge_count; ++e) {
    const auto vertices = hinge(mesh, e);
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < i; ++j) add(vertices[i], vertices[j]);
    }
  }
  const auto count = static_cast<Eigen::Index>(mesh.vertex_count);
  LowerTriangle pattern(count, count);
  pattern.setFromTriplets(entries.begin(), entries.end());
  pattern.makeCompressed();
  return pattern;
}

}  // namespace

HingeMetric::HingeMetric(const FlatMesh& mesh, ThreadTeam& team)
    : mesh_(mesh), team_(team), matrix_(pattern_of(mesh)), factors_(matrix_) {
  const auto place = [&](Index i, Index j) {
    const int row = static_cast<int>(std::max(i, j)), column = static_cast<int>(std::min(i, j));
    const int* begin = matrix_.innerIndexPtr() + matrix_.outerIndexPtr()[column];
    const int* end = matrix_.innerIndexPtr() + matrix_.outerIndexPtr()[column + 1];
    return static_cast<Index>(std::lower_bound(begin, end, row) - matrix_.innerIndexPtr());
  };
  for (Index v = 0; v < mesh.vertex_count; ++v) diagonal_places_.push_back(place(v, v));
  places_.resize(mesh.edge_count);
  for (std::size_t e = 0; e < mesh.edge_count; ++e) {
    const auto vertices = hinge(mesh, e);
    std::size_t next = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j <= i; ++j) places_[e][next++] = place(vertices[i], vertices[j]);
    }
  }
}

std::array<double, 4> HingeMetric::stencil(std::span<const float> positions, std::size_t edge,
                                           float fading_area) const {
  constexpr double kLeastSquare = 1e-3, kLeastFading = 1e-4;
  const double fading = std::max(kLeastFading, static_cast<double>(fading_area) * static_cast<double>(fading_area));
  const auto vertices = hinge(mesh_, edge);
  const auto at = [&](std::size_t k) {
    const auto p = vector_at(positions, vertices[k]);
    return Vec3(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2]));
  };
  const Vec3 origin = at(2), along = at(3) - origin;
  const double square = std::max(kLeastSquare, along.squaredNorm());
  std::array<double, 2> height{}, foot{};
  for (std::size_t k = 0; k < 2; ++k) {
    const Vec3 corner = at(k) - origin;
    height[k] = std::sqrt(square) / std::sqrt(along.cross(corner).squaredNorm() + fading);
    foot[k] = std::clamp(corner.dot(along) / square, -1.0, 2.0);
  }
  return {height[0], height[1], -(1 - foot[0]) * height[0] - (1 - foot[1]) * height[1],
          -foot[0] * height[0] - foot[1] * height[1]};
}

void HingeMetric::factorize(std::span<const float> positions, std::span<const float> stiffness,
                            std::span<const double> diagonal, float fading_area) {
  constexpr double kRegularization = 1e-7;  // of the mean of the diagonal
  double* values = matrix_.valuePtr();
  std::fill(values, values + matrix_.nonZeros(), 0.0);
  for (std::size_t e = 0; e < mesh_.edge_count; ++e) {
    const auto s = stencil(positions, e, fading_area);
    const auto k = static_cast<double>(stiffness[e]);
    std::size_t next = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j <= i; ++j) values[places_[e][next++]] += k * s[i] * s[j];
    }
  }
  double trace = 0;
  for (std::size_t v = 0; v < mesh_.vertex_count; ++v) {
    values[diagonal_places_[v]] += diagonal[v];
    trace += values[diagonal_places_[v]];
  }
  const double least = kRegularization * trace / static_cast<double>(mesh_.vertex_count);
  for (const Index place : diagonal_places_) values[place] += least;
  factors_.factorize(matrix_, team_);
}

void HingeMetric::solve(std::span<float> vectors) const {
  const std::size_t count = mesh_.vertex_count;
  std::vector<HalfLanes> lanes(count);
  for (std::size_t v = 0; v < count; ++v)
    lanes[v] = HalfLanes{vectors[v], vectors[count + v], vectors[2 * count + v], 0};
  factors_.solve(lanes, team_);
  for (std::size_t v = 0; v < count; ++v) {
    for (std::size_t axis = 0; axis < 3; ++axis) vectors[axis * count + v] = lanes[v][axis];
  }
}

}  // namespace crease
