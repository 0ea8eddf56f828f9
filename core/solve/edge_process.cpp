#include "core/solve/edge_process.h"

namespace crease {

void EdgeProcess::set_label(Index edge, double label) {
  terms_.label_set(field_, edge, label - field_.labels[edge]);
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

}  // namespace crease
