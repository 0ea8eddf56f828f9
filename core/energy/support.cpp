#include "core/energy/support.h"

namespace crease {

void SupportTerm::positions_changed(const Field& field, ThreadTeam& team) {
  team.run(sums_.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t v = begin; v < end; ++v) {
      Vec3 sum = Vec3::Zero();
      for (const Index e : field.topology.vertex_edges[v]) {
        sum += (field.topology.edges[e].v0 == v ? field.labels[e] : -field.labels[e]) * field.edges.direction[e];
      }
      sums_[v] = sum;
    }
  });
}

/// Σ over pairs at a vertex of u·u' ε ε' is half of |Σ u ε|² − Σ ε²|u|².
double SupportTerm::energy(const Field& field, ThreadTeam& team) const {
  const double squares = block_sum<double>(sums_.size(), team, [&](std::size_t v) { return sums_[v].squaredNorm(); }) -
                         2 * block_sum<double>(field.labels.size(), team, [&](std::size_t e) {
                           return field.labels[e] * field.labels[e] * field.edges.direction[e].squaredNorm();
                         });
  return squares / 2;
}

void SupportTerm::label_set(const Field& field, Index edge, double by) {
  const auto [v0, v1] = field.topology.edges[edge];
  const Vec3 change = by * field.edges.direction[edge];
  sums_[v0] += change;
  sums_[v1] -= change;
}

double SupportTerm::slope(const Field& field, Index edge) const {
  const auto [v0, v1] = field.topology.edges[edge];
  const Vec3& along = field.edges.direction[edge];
  const Vec3 own = field.labels[edge] * along;
  return -(along.dot(sums_[v1] + own) - along.dot(sums_[v0] - own));
}

}  // namespace crease
