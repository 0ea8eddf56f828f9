#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/base/random.h"
#include "core/energy/terms.h"
#include "core/geometry/rings.h"
#include "core/solve/metropolis.h"
#include "core/solve/schedule.h"

namespace crease {

/// The vertex process (§3.2) while the labels stand still.
class VertexProcess {
 public:
  /// The terms must know the field's labels. All three must outlive the process.
  VertexProcess(Field& field, const EnergyTerms& terms, const Schedule& schedule, std::size_t threads);

  /// E with the vertex of `slot` (a place in the schedule) at `position` minus E now.
  double delta_energy(std::size_t slot, const Vec3& position, const Weights& weights);

  /// One Metropolis pass over all sites: a displacement uniform in a cube of half-width `step`, kept with probability
  /// min(1, exp(−ΔE/T)). Normals are kept up to date.
  ProposalCount sweep(const Weights& weights, const CounterRandom& random, std::uint32_t sweep_index,
                      double temperature, double step, ThreadTeam& team);

 private:
  /// Sites of a run are independent, so this many proposals are computed before the first is decided: a decision is a
  /// coin toss that no processor predicts, and waiting for each would leave it idle.
  static constexpr std::size_t kBatch = 8;
  struct Batch {
    std::size_t count = 0;
    std::array<double, kBatch> delta{};
    std::array<std::uint32_t, kBatch> word{};
  };

  void propose_batch(std::span<VertexMove, kBatch> moves, const Weights& weights, std::size_t first,
                     const CounterRandom& random, std::uint32_t sweep_index, double step, Batch& batch) const;

  Field& field_;
  const EnergyTerms& terms_;
  const Schedule& schedule_;
  Rings rings_;
  std::vector<VertexMove> moves_;  ///< a batch for each thread
};

}  // namespace crease
