#include "core/smooth/vertex_descent.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/smooth/potential.h"

namespace crease {
namespace {

constexpr std::size_t kChunk = 2048;
/// Where ‖n_i − n_j‖ turns from a cone into a paraboloid: half a degree.
constexpr float kRounding = 0.01F;
/// Twice the area in squared mean edge lengths below which a normal fades to zero.
constexpr double kFadingArea = 1e-3;
constexpr int kMostTrials = 12;

double dot(const std::vector<Vec3>& a, const std::vector<Vec3>& b, ThreadTeam& team) {
  return block_sum<double>(a.size(), team, [&](std::size_t i) { return a[i].dot(b[i]); });
}

}  // namespace

VertexEnergy::VertexEnergy(Field& field)
    : field_(field), normals_(field.faces.size()), lengths_(field.faces.size()), area_gradients_(field.faces.size()) {}

void VertexEnergy::set_model(const EnergyModel& model, ThreadTeam& team) {
  model_ = model;
  ridge_straightness_.reset();
  if (model.ridge_line_weight > 0) ridge_straightness_.emplace(field_, team);
}

float VertexEnergy::rounding() const {
  return model_.smoothness == Smoothness::kSquareRoot ? kRounding * kRounding : 0;
}

Vec3 VertexEnergy::second_difference(Index face) const {
  return field_.second_difference.of(field_, face, [&](Index f) { return normals_[f]; });
}

double VertexEnergy::value(ThreadTeam& team) {
  const Topology& topology = field_.topology;
  team.run(normals_.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t f = begin; f < end; ++f) {
      const auto [a, b, c] = field_.faces[f];
      const Vec3 area = (field_.positions[b] - field_.positions[a]).cross(field_.positions[c] - field_.positions[a]);
      lengths_[f] = std::sqrt(area.squaredNorm() + kFadingArea * kFadingArea);
      normals_[f] = area / lengths_[f];
    }
  });
  const double smoothness = block_sum<double>(topology.edges.size(), team, [&](std::size_t e) {
    if (!topology.is_interior(e)) return 0.0;
    const auto [f0, f1] = topology.edge_faces[e];
    const double square = (normals_[f0] - normals_[f1]).squaredNorm() + static_cast<double>(rounding());
    return (1 - field_.labels[e]) * smoothness_potential(model_.smoothness, square, model_.smoothness_width);
  });
  const double likelihood = block_sum<double>(field_.positions.size(), team, [&](std::size_t v) {
    return field_.likelihood.energy(field_, static_cast<Index>(v));
  });
  double value = model_.smoothness_weight * smoothness + model_.likelihood_weight * likelihood;
  if (model_.curvature_weight > 0) {
    value += model_.curvature_weight * block_sum<double>(normals_.size(), team, [&](std::size_t f) {
               const auto face = static_cast<Index>(f);
               return SecondDifference::gate(field_, face) * second_difference(face).squaredNorm();
             });
  }
  if (ridge_straightness_) {
    value += model_.ridge_line_weight * block_sum<double>(field_.positions.size(), team, [&](std::size_t v) {
               return ridge_straightness_->energy(field_, static_cast<Index>(v));
             });
  }
  return value;
}

/// ∂E/∂n_f.
Vec3 VertexEnergy::normal_gradient(Index face) const {
  const Topology& topology = field_.topology;
  Vec3 gradient = Vec3::Zero();
  for (const Index edge : topology.face_edges[face]) {
    if (edge == kNone || !topology.is_interior(edge)) continue;
    const auto [f0, f1] = topology.edge_faces[edge];
    const Index other = f0 == face ? f1 : f0;
    const Vec3 difference = normals_[face] - normals_[other];
    const float slope = smoothness_slope(model_.smoothness, static_cast<float>(difference.squaredNorm()) + rounding(),
                                         model_.smoothness_width);
    gradient += 2 * model_.smoothness_weight * (1 - field_.labels[edge]) * static_cast<double>(slope) * difference;
    if (model_.curvature_weight > 0) {
      gradient -= 2 * model_.curvature_weight * SecondDifference::gate(field_, other) *
                  field_.second_difference.weight(field_, other, edge) * second_difference(other);
    }
  }
  if (model_.curvature_weight > 0) {
    gradient += 2 * model_.curvature_weight * SecondDifference::gate(field_, face) * second_difference(face);
  }
  return gradient;
}

/// Through dn = (dN − n (n·dN)) / s for n = N / s, s² = ‖N‖² + const, and N = (b − a) × (c − a).
void VertexEnergy::gradient(std::vector<Vec3>& gradient, ThreadTeam& team) {
  team.run(normals_.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t f = begin; f < end; ++f) {
      const Vec3 by_normal = normal_gradient(static_cast<Index>(f));
      area_gradients_[f] = (by_normal - normals_[f].dot(by_normal) * normals_[f]) / lengths_[f];
    }
  });
  gradient.resize(field_.positions.size());
  team.run(gradient.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto vertex = static_cast<Index>(i);
      Vec3 sum = model_.likelihood_weight * field_.likelihood.gradient(field_, vertex);
      for (const Index f : field_.topology.vertex_faces[vertex]) {
        const Triangle& corners = field_.faces[f];
        const auto k = static_cast<std::size_t>(std::ranges::find(corners, vertex) - corners.begin());
        sum += (field_.positions[corners[(k + 2) % 3]] - field_.positions[corners[(k + 1) % 3]])
                   .cross(area_gradients_[f]) *
               -1;
      }
      if (ridge_straightness_) sum += model_.ridge_line_weight * ridge_straightness_->gradient(field_, vertex);
      gradient[i] = sum;
    }
  });
}

VertexDescent::VertexDescent(Field& field)
    : field_(field), energy_(field), search_(field.positions.size(), Vec3::Zero()) {}

void VertexDescent::run(const EnergyModel& model, ThreadTeam& team) {
  energy_.set_model(model, team);
  const double value = energy_.value(team);
  energy_.gradient(gradient_, team);
  const double last = previous_.empty() ? 0 : dot(previous_, previous_, team);
  const double beta = last > 0 ? (dot(gradient_, gradient_, team) - dot(gradient_, previous_, team)) / last : 0;
  for (std::size_t i = 0; i < search_.size(); ++i) search_[i] = std::max(beta, 0.0) * search_[i] - gradient_[i];
  double slope = dot(search_, gradient_, team);
  if (slope >= 0) {
    for (std::size_t i = 0; i < search_.size(); ++i) search_[i] = -gradient_[i];
    slope = -dot(gradient_, gradient_, team);
  }
  previous_ = gradient_;
  from_ = field_.positions;
  descend(value, slope, team);
  field_.update_normals(team);
}

void VertexDescent::exchange(StateArchive& archive) {
  archive.values_or_none(previous_, field_.positions.size());
  archive.values(search_);
  archive.value(last_decrease_);
}

double VertexDescent::try_step(double length, ThreadTeam& team) {
  team.run(from_.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t v = begin; v < end; ++v) field_.positions[v] = from_[v] + length * search_[v];
  });
  return energy_.value(team);
}

/// Tries a step, then the one to where the parabola through it has its minimum, and takes the better.
void VertexDescent::descend(double value, double slope, ThreadTeam& team) {
  if (!(slope < 0)) return;
  double length = last_decrease_ > 0 ? 2 * last_decrease_ / -slope : first_length();
  for (int trial = 0; trial < kMostTrials; ++trial) {
    const double found = try_step(length, team);
    const double excess = found - value - slope * length;
    const double best = excess > 0 ? -slope * length * length / (2 * excess) : 4 * length;
    if (found < value) {
      const double better = try_step(std::min(best, 4 * length), team);
      if (!(better < found)) try_step(length, team);
      last_decrease_ = value - std::min(better, found);
      return;
    }
    length = std::clamp(best, 0.1 * length, 0.5 * length);
  }
  field_.positions = from_;
  search_.assign(search_.size(), Vec3::Zero());
  last_decrease_ = 0;
}

/// Moves no vertex by more than a tenth of the mean edge length.
double VertexDescent::first_length() const {
  double most = 0;
  for (const Vec3& component : search_) most = std::max(most, component.norm());
  return 0.1 / most;
}

}  // namespace crease
