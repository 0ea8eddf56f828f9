#include "core/smooth/likelihood.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/smooth/field.h"

namespace crease {
namespace {

std::vector<Vec3> area_vectors(const std::vector<Vec3>& positions, const std::vector<Triangle>& faces) {
  std::vector<Vec3> areas(positions.size(), Vec3::Zero());
  for (const auto& [a, b, c] : faces) {
    const Vec3 area = (positions[b] - positions[a]).cross(positions[c] - positions[a]) / 6;
    for (const Index v : {a, b, c}) areas[v] += area;
  }
  return areas;
}

}  // namespace

Likelihood::Likelihood(const std::vector<Vec3>& measured, const std::vector<Triangle>& faces, const MrfOptions& options,
                       std::span<const double> weights)
    : kind_(options.likelihood),
      width_(options.likelihood_width),
      across_(options.likelihood_across),
      volume_weight_(options.volume_weight),
      weights_(weights.begin(), weights.end()) {
  weights_.resize(measured.size(), 1.0);
  const bool anisotropic = kind_ == LikelihoodKind::kAnisotropic;
  if (anisotropic && options.scan_direction.norm() > 0) fixed_direction_ = options.scan_direction.normalized();
  if (kind_ == LikelihoodKind::kVolume || (anisotropic && !fixed_direction_)) {
    vertex_areas_ = area_vectors(measured, faces);
    for (const Vec3& area : vertex_areas_) vertex_normals_.push_back(area.stableNormalized());
  }
}

double Likelihood::alone(Index vertex, const Vec3& displacement) const {
  const double square = displacement.squaredNorm();
  switch (kind_) {
    case LikelihoodKind::kHuber:
      return square < width_ * width_ ? square : 2 * width_ * std::sqrt(square) - width_ * width_;
    case LikelihoodKind::kAnisotropic: {
      const double along = displacement.dot(direction(vertex));
      return along * along + across_ * (square - along * along);
    }
    default:
      return square;
  }
}

Likelihood::Flow Likelihood::flow(const Field& field, Index vertex) const {
  Flow flow;
  const auto add = [&](Index v) {
    flow.volume += vertex_areas_[v].dot(field.positions[v] - field.measured[v]);
    flow.area += vertex_areas_[v].norm();
  };
  add(vertex);
  for (const Index e : field.topology.vertex_edges[vertex]) add(other_end(field.topology.edges[e], vertex));
  return flow;
}

double Likelihood::flow_change(const Field& field, Index vertex, const Vec3& step) const {
  const double swept = vertex_areas_[vertex].dot(step);
  double change = 0;
  const auto add = [&](Index v) {
    Flow after = flow(field, v);
    const double before = after.square();
    after.volume += swept;
    change += weights_[v] * (after.square() - before);
  };
  add(vertex);
  for (const Index e : field.topology.vertex_edges[vertex]) add(other_end(field.topology.edges[e], vertex));
  return change;
}

double Likelihood::energy(const Field& field, Index vertex) const {
  double energy = alone(vertex, field.positions[vertex] - field.measured[vertex]);
  if (kind_ == LikelihoodKind::kVolume) energy += volume_weight_ * flow(field, vertex).square();
  return weights_[vertex] * energy;
}

Vec3 Likelihood::gradient_alone(Index vertex, const Vec3& displacement) const {
  switch (kind_) {
    case LikelihoodKind::kHuber:
      return 2 * std::min(1.0, width_ / std::max(displacement.norm(), width_)) * displacement;
    case LikelihoodKind::kAnisotropic: {
      const Vec3 along = displacement.dot(direction(vertex)) * direction(vertex);
      return 2 * (along + across_ * (displacement - along));
    }
    default:
      return 2 * displacement;
  }
}

Vec3 Likelihood::gradient(const Field& field, Index vertex) const {
  Vec3 gradient = weights_[vertex] * gradient_alone(vertex, field.positions[vertex] - field.measured[vertex]);
  if (kind_ != LikelihoodKind::kVolume) return gradient;
  double slope = 0;
  const auto add = [&](Index v) {
    const Flow here = flow(field, v);
    if (here.area > 0) slope += weights_[v] * 2 * here.volume / (here.area * here.area);
  };
  add(vertex);
  for (const Index e : field.topology.vertex_edges[vertex]) add(other_end(field.topology.edges[e], vertex));
  return gradient + volume_weight_ * slope * vertex_areas_[vertex];
}

double Likelihood::general_change(const Field& field, Index vertex, const Vec3& to) const {
  const Vec3& from = field.positions[vertex];
  const Vec3& measured = field.measured[vertex];
  double change = weights_[vertex] * (alone(vertex, to - measured) - alone(vertex, from - measured));
  if (kind_ == LikelihoodKind::kVolume) change += volume_weight_ * flow_change(field, vertex, to - from);
  return change;
}

}  // namespace crease
