#include "core/smooth/edge_process.h"

#include <cmath>

namespace crease {

double EdgeProcess::slope(Index edge) const {
  const auto [v0, v1] = field_.topology.edges[edge];
  const Vec3& along = terms_.direction[edge];
  const Vec3 own = field_.labels[edge] * along;
  const double support = along.dot(terms_.label_sum[v1] + own) - along.dot(terms_.label_sum[v0] - own);
  double slope =
      -model_.smoothness_weight * terms_.potential[edge] +
      model_.sharpness_weight * (model_.sharpness_threshold - terms_.angle[edge] - model_.support_weight * support);
  if (model_.continuity_weight > 0) slope += model_.continuity_weight * continuity_slope(field_, terms_, edge);
  if (model_.curvature_weight > 0) {
    for (const Index face : field_.topology.edge_faces[edge]) {
      slope -= model_.curvature_weight * SecondDifference::gate(field_, face, edge) * terms_.curvature[face];
    }
  }
  return slope;
}

void EdgeProcess::set_label(Index edge, double label) {
  const auto [v0, v1] = field_.topology.edges[edge];
  const Vec3 change = (label - field_.labels[edge]) * terms_.direction[edge];
  terms_.label_sum[v0] += change;
  terms_.label_sum[v1] -= change;
  field_.labels[edge] = label;
}

bool EdgeProcess::visit(Index edge, const CounterRandom& random, std::uint32_t sweep_index, double temperature) {
  const CounterRandom::Words words = random(sweep_index, edge);
  const double label = CounterRandom::unit(words[0]);
  if (!metropolis_accepts(delta_energy(edge, label), temperature, words[1])) return false;
  set_label(edge, label);
  return true;
}

ProposalCount EdgeProcess::sweep(const Schedule& schedule, const CounterRandom& random, std::uint32_t sweep_index,
                                 double temperature, ThreadTeam& team) {
  return metropolis_sweep(schedule, team, [&](std::size_t begin, std::size_t end, std::size_t) {
    std::uint64_t accepted = 0;
    for (std::size_t slot = begin; slot < end; ++slot) {
      accepted += visit(schedule.sites[slot], random, sweep_index, temperature) ? 1 : 0;
    }
    return accepted;
  });
}

void EdgeProcess::relax(const Schedule& schedule, double temperature, ThreadTeam& team) {
  metropolis_sweep(schedule, team, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t slot = begin; slot < end; ++slot) {
      const Index edge = schedule.sites[slot];
      set_label(edge, 1 / (1 + std::exp(slope(edge) / temperature)));
    }
    return std::uint64_t{0};
  });
}

}  // namespace crease
