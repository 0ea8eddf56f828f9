#include "core/energy/likelihood.h"

#include <algorithm>
#include <cmath>

#include "core/energy/points.h"

namespace crease {
namespace {

std::vector<Vec3> thirds_of_areas(const Surface& surface) {
  std::vector<Vec3> areas(surface.positions.size(), Vec3::Zero());
  for (const Triangle& face : surface.faces) {
    const Vec3 third = area_vector(surface.measured, face) / 6;
    for (const Index v : face) areas[v] += third;
  }
  return areas;
}

}  // namespace

LikelihoodTerm::LikelihoodTerm(const TermSetup& setup)
    : topology_(setup.field.topology),
      measured_(setup.field.measured),
      kind_(setup.options.likelihood),
      width_(setup.options.likelihood_width),
      across_(setup.options.likelihood_across),
      volume_weight_(setup.options.volume_weight),
      weights_(setup.vertex_weights.begin(), setup.vertex_weights.end()) {
  weights_.resize(measured_.size(), 1.0);
  const Vec3& scan_direction = setup.options.scan_direction;
  const bool anisotropic = kind_ == LikelihoodKind::kAnisotropic;
  if (anisotropic && scan_direction.norm() > 0) fixed_direction_ = scan_direction.normalized();
  if (kind_ == LikelihoodKind::kVolume || (anisotropic && !fixed_direction_)) {
    vertex_areas_ = thirds_of_areas(setup.field);
    for (const Vec3& area : vertex_areas_) vertex_normals_.push_back(area.stableNormalized());
  }
}

double LikelihoodTerm::energy(const Field& field, ThreadTeam& team) const {
  return block_sum<double>(field.positions.size(), team,
                           [&](std::size_t v) { return at_positions(FieldPoints{field}, static_cast<Index>(v)); });
}

double LikelihoodTerm::general_change(const Field& field, Index vertex, const Vec3& to) const {
  const Vec3 &from = field.positions[vertex], &measured = measured_[vertex];
  double change = weights_[vertex] * (alone<Vec3>(vertex, to - measured) - alone<Vec3>(vertex, from - measured));
  if (kind_ == LikelihoodKind::kVolume) change += volume_weight_ * flow_change(field, vertex, to - from);
  return change;
}

double LikelihoodTerm::flow_change(const Field& field, Index vertex, const Vec3& step) const {
  const double swept = vertex_areas_[vertex].dot(step);
  double change = 0;
  visit_neighborhood(vertex, [&](Index v) {
    auto after = flow(FieldPoints{field}, v);
    const double before = after.square();
    after.volume += swept;
    change += weights_[v] * (after.square() - before);
  });
  return change;
}

}  // namespace crease
