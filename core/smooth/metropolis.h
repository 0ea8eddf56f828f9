#pragma once

#include <cmath>
#include <vector>

#include "core/smooth/coloring.h"
#include "core/smooth/random.h"
#include "core/smooth/thread_team.h"

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

/// Visits every site once, group by group; `visit(slot, thread)` with a place in
/// `coloring.sites` says whether its proposal was accepted. Sites of a
/// group run on any thread in any order.
template <typename Visit>
ProposalCount metropolis_sweep(const Coloring& coloring, ThreadTeam& team, Visit visit) {
  constexpr std::size_t kChunk = 256;
  struct alignas(64) Padded {
    std::uint64_t count = 0;
  };
  std::vector<Padded> accepted(team.size());
  for (std::size_t group = 0; group < coloring.groups(); ++group) {
    const std::size_t first = coloring.starts[group];
    team.run(coloring.starts[group + 1] - first, kChunk, [&](std::size_t begin, std::size_t end, std::size_t thread) {
      std::uint64_t chunk_accepted = 0;
      for (std::size_t i = begin; i < end; ++i) chunk_accepted += visit(first + i, thread) ? 1 : 0;
      accepted[thread].count += chunk_accepted;
    });
  }
  ProposalCount result{coloring.sites.size(), 0};
  for (const Padded& padded : accepted) result.accepted += padded.count;
  return result;
}

}  // namespace crease
