#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "core/smooth/field.h"
#include "core/smooth/metropolis.h"
#include "core/smooth/random.h"
#include "core/smooth/ridge_straightness.h"
#include "core/smooth/rings.h"
#include "core/smooth/schedule.h"

namespace crease {

/// The vertex process (§3.2) while the labels stand still.
class VertexProcess {
 public:
  /// The field and the schedule must outlive the process.
  VertexProcess(Field& field, const Schedule& schedule, std::size_t threads);
  ~VertexProcess();

  /// Takes over the weights and the field's labels for the proposals that follow.
  void set_model(const EnergyModel& model, ThreadTeam& team);

  /// E with the vertex of `slot` (a place in the schedule) at `position` minus E now.
  double delta_energy(std::size_t slot, const Vec3& position);

  /// One Metropolis pass over all sites: a displacement uniform in a cube of half-width `step`, kept with probability
  /// min(1, exp(−ΔE/T)). Normals are kept up to date.
  ProposalCount sweep(const CounterRandom& random, std::uint32_t sweep_index, double temperature, double step,
                      ThreadTeam& team);

 private:
  class Visit;  // one vertex lifted out of the field

  /// Sites of a run are independent, so this many proposals are computed before the first is decided: a decision is a
  /// coin toss that no processor predicts, and waiting for each would leave it idle.
  static constexpr std::size_t kBatch = 8;
  struct Batch {
    std::size_t count = 0;
    std::array<double, kBatch> delta{};
    std::array<std::uint32_t, kBatch> word{};
  };

  void propose_batch(std::span<Visit, kBatch> visits, std::size_t first, const CounterRandom& random,
                     std::uint32_t sweep_index, double step, Batch& batch) const;

  Field& field_;
  const Schedule& schedule_;
  Rings rings_;
  EnergyModel model_;
  std::vector<float> smoothing_;                         ///< 1 − ε per edge, 0 for Rings::no_edge
  std::optional<RidgeStraightness> ridge_straightness_;  ///< where the model has a term for it
  std::vector<Visit> visits_;                            ///< a batch for each thread
};

}  // namespace crease
