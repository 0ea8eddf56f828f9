#include "core/energy/sharpness.h"

#include <cmath>

namespace crease {

SharpnessTerm::SharpnessTerm(const TermSetup& setup)
    : threshold_(setup.options.sharpness_threshold),
      limit_(setup.options.sharpness_limit),
      ridge_kind_(setup.options.ridge_kind) {}

double SharpnessTerm::angle(double dihedral) const {
  const double angle = std::abs(dihedral);
  const bool right_kind = ridge_kind_ == RidgeKind::kAll || (ridge_kind_ == RidgeKind::kConvex) == (dihedral > 0);
  return right_kind && angle <= limit_ ? angle : -angle;
}

double SharpnessTerm::energy(const Field& field, ThreadTeam& team) const {
  return block_sum<double>(field.labels.size(), team,
                           [&](std::size_t e) { return (threshold_ - angle(field.edges.angle[e])) * field.labels[e]; });
}

}  // namespace crease
