#pragma once

#include "core/base/random.h"
#include "core/energy/terms.h"
#include "core/solve/metropolis.h"
#include "core/solve/schedule.h"

namespace crease {

/// The edge process (§3.3) while the positions stand still: E is linear in every single label.
class EdgeProcess {
 public:
  /// The terms must know the field's positions; what they keep of its labels for slope() follows the labels. All three
  /// must outlive the process.
  EdgeProcess(Field& field, EnergyTerms& terms, const Weights& weights)
      : field_(field), terms_(terms), weights_(weights) {}

  /// E with `label` on `edge` minus E now. Interior edges only.
  double delta_energy(Index edge, double label) const { return slope(edge) * (label - field_.labels[edge]); }
  /// ∂E/∂ε of an edge.
  double slope(Index edge) const { return terms_.slope(field_, weights_, edge); }
  void set_label(Index edge, double label);

  /// One Metropolis pass over all interior edges: a new label uniform in [0, 1], kept with probability
  /// min(1, exp(−ΔE/T)).
  ProposalCount sweep(const Schedule& schedule, const CounterRandom& random, std::uint32_t sweep_index,
                      double temperature, ThreadTeam& team);

 private:
  bool visit(Index edge, const CounterRandom& random, std::uint32_t sweep_index, double temperature);

  Field& field_;
  EnergyTerms& terms_;
  const Weights& weights_;
};

}  // namespace crease
