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

/// The Metropolis rule (§3.5): downhill always, uphill with probability exp(−ΔE/T).
inline bool metropolis_accepts(double delta_energy, double temperature, std::uint32_t word) {
  return delta_energy <= 0 || CounterRandom::unit(word) < std::exp(-delta_energy / temperature);
}

/// Visits every site once, group by group; `visit(site, thread)` says whether its proposal was accepted. Sites of a
/// group run on any thread in any order.
template <typename Visit>
ProposalCount metropolis_sweep(const Coloring& coloring, ThreadTeam& team, Visit visit) {
  constexpr std::size_t kChunk = 256;
  struct alignas(64) Padded {
    std::uint64_t count = 0;
  };
  std::vector<Padded> accepted(team.size());
  for (std::size_t group = 0; group < coloring.groups(); ++group) {
    const Index* sites = coloring.sites.data() + coloring.starts[group];
    const std::size_t count = coloring.starts[group + 1] - coloring.starts[group];
    team.run(count, kChunk, [&](std::size_t begin, std::size_t end, std::size_t thread) {
      std::uint64_t chunk_accepted = 0;
      for (std::size_t i = begin; i < end; ++i) chunk_accepted += visit(sites[i], thread) ? 1 : 0;
      accepted[thread].count += chunk_accepted;
    });
  }
  ProposalCount result{coloring.sites.size(), 0};
  for (const Padded& padded : accepted) result.accepted += padded.count;
  return result;
}

}  // namespace crease
