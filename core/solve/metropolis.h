#pragma once

#include <cmath>
#include <vector>

#include "core/base/random.h"
#include "core/base/thread_team.h"
#include "core/solve/schedule.h"

namespace crease {

/// How many proposals a pass made and accepted.
struct ProposalCount {
  std::uint64_t proposed = 0, accepted = 0;
  double acceptance() const {
    return proposed != 0 ? static_cast<double>(accepted) / static_cast<double>(proposed) : 0;
  }
};

/// The Metropolis rule (§3.5): downhill always, uphill with probability exp(−ΔE/T). Most cases are settled by
/// 1 − x ≤ exp(−x) ≤ 1/(1 + x + x²/2) without the exponential.
inline bool metropolis_accepts(double delta_energy, double temperature, std::uint32_t word) {
  if (delta_energy <= 0) return true;
  const double x = delta_energy / temperature;
  const double uniform = CounterRandom::unit(word);
  if (uniform < 1 - x) return true;
  if (uniform * (1 + x + x * x / 2) > 1) return false;
  return uniform < std::exp(-x);
}

/// Visits every site once. `visit(begin, end, thread)` makes and decides a proposal for each of these places in
/// `schedule.sites`, a run, and returns how many it accepted.
template <typename Visit>
ProposalCount metropolis_sweep(const Schedule& schedule, ThreadTeam& team, Visit visit) {
  struct alignas(64) Padded {
    std::uint64_t count = 0;
  };
  std::vector<Padded> accepted(team.size());
  for (std::size_t phase = 0; phase + 1 < schedule.phases.size(); ++phase) {
    const std::size_t first = schedule.phases[phase];
    team.run(schedule.phases[phase + 1] - first, 1, [&](std::size_t begin, std::size_t end, std::size_t thread) {
      std::uint64_t count = 0;
      for (std::size_t run = schedule.tasks[first + begin]; run < schedule.tasks[first + end]; ++run) {
        count += visit(schedule.runs[run], schedule.runs[run + 1], thread);
      }
      accepted[thread].count += count;
    });
  }
  ProposalCount result{schedule.sites.size(), 0};
  for (const Padded& padded : accepted) result.accepted += padded.count;
  return result;
}

}  // namespace crease
