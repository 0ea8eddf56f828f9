#include "core/solve/descent.h"

#include <utility>

namespace crease {

Descent::Descent(Field& field, const EnergyTerms& terms, std::vector<std::uint8_t> fixed)
    : field_(field),
      fixed_(std::move(fixed)),
      gradient_(field, terms),
      search_(3 * field.positions.size()),
      x_(3 * field.positions.size()) {}

double Descent::evaluate(const Weights& weights, std::span<const double> x, std::span<double> gradient,
                         ThreadTeam& team) {
  const double value = gradient_(weights, x, gradient, team);
  const std::size_t count = fixed_.size();
  for (std::size_t v = 0; v < count; ++v) {
    if (fixed_[v] == 0) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) gradient[axis * count + v] = 0;
  }
  return value;
}

bool Descent::step(const Weights& weights, ThreadTeam& team) {
  const std::size_t count = field_.positions.size();
  for (std::size_t v = 0; v < count; ++v) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      x_[axis * count + v] = field_.positions[v][static_cast<Eigen::Index>(axis)];
    }
  }
  if (weights != weights_) search_.function_changed();
  weights_ = weights;
  const bool may_gain = search_.step(
      x_, [&](std::span<const double> x, std::span<double> gradient) { return evaluate(weights, x, gradient, team); },
      team);
  for (std::size_t v = 0; v < count; ++v) field_.positions[v] = {x_[v], x_[count + v], x_[2 * count + v]};
  field_.update_normals(team);
  return may_gain;
}

}  // namespace crease
