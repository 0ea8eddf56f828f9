#pragma once

#include <vector>

#include "core/smooth/field.h"
#include "core/smooth/metropolis.h"
#include "core/smooth/random.h"
#include "core/smooth/schedule.h"

namespace crease {

/// The edge process (§3.3) while the positions stand still: E is linear in every single label.
class EdgeProcess {
 public:
  /// `terms` must be of the field as it is; their label sums follow the labels. Both must outlive the process.
  EdgeProcess(Field& field, EdgeTerms& terms, const EnergyModel& model) : field_(field), terms_(terms), model_(model) {}

  /// E with `label` on `edge` minus E now. Interior edges only.
  double delta_energy(Index edge, double label) const { return slope(edge) * (label - field_.labels[edge]); }
  /// ∂E/∂ε of an edge.
  double slope(Index edge) const;
  void set_label(Index edge, double label);

  /// One Metropolis pass over all interior edges: a new label uniform in [0, 1], kept with probability
  /// min(1, exp(−ΔE/T)).
  ProposalCount sweep(const Schedule& schedule, const CounterRandom& random, std::uint32_t sweep_index,
                      double temperature, ThreadTeam& team);

  /// One pass of mean field: every label becomes its expectation 1 / (1 + exp(slope / T)), its neighbours at theirs.
  void relax(const Schedule& schedule, double temperature, ThreadTeam& team);

 private:
  bool visit(Index edge, const CounterRandom& random, std::uint32_t sweep_index, double temperature);

  Field& field_;
  EdgeTerms& terms_;
  EnergyModel model_;
};

}  // namespace crease
