#pragma once

#include <vector>

#include "core/base/random.h"
#include "core/base/state_archive.h"
#include "core/energy/terms.h"
#include "core/solve/metropolis.h"
#include "core/solve/schedule.h"

namespace crease {

/// The face process (§5, Fig. 6): sites are faces, labels are their unit normals, while the positions stand still.
///
///     E(n) = α_n Σ_f a_f ‖n_f − n⁰_f‖² + β Σ_e (1 − ε_e) ρ(n_i − n_j) + βν Σ_(i,j) g_ij ρ(n_i − n_j)
///
/// with a_f the face's area relative to the mean, and (i, j) faces up to three apart on the way round a common vertex;
/// g_ij is the product of (1 − ε) over the edges crossed on that way, the better of the two ways.
class FaceProcess {
 public:
  /// Works on the field's normals. Field and terms must outlive the process.
  FaceProcess(Field& field, const EnergyTerms& terms, double normal_weight, double corner_weight);

  /// Takes the field's normals and areas as the measured ones.
  void measure(ThreadTeam& team);
  void exchange(StateArchive& archive);
  /// Takes over the field's labels for the visits that follow, after EnergyTerms::labels_changed().
  void labels_changed(ThreadTeam& team);

  /// The terms above: likelihood, and smoothness with the pairs at corners.
  double likelihood(ThreadTeam& team) const;
  double smoothness(ThreadTeam& team) const;
  /// E with `normal` on `face` minus E now.
  double delta_energy(Index face, const UnitNormal& normal) const;

  /// One Metropolis pass: a normal turned by up to about `step` radians in a random direction, kept with probability
  /// min(1, exp(−ΔE/T)).
  ProposalCount sweep(const Schedule& schedule, const CounterRandom& random, std::uint32_t sweep_index,
                      double temperature, double step, ThreadTeam& team);

 private:
  struct Neighbor {
    Index face = 0;
    Index pair = 0;  ///< its weight
  };

  void find_corner_pairs();
  double rho(const UnitNormal& difference) const {
    return smoothness_.rho(static_cast<double>(difference.squaredNorm())).value;
  }
  template <typename Visit>
  void visit_neighbors(Index face, Visit visit) const;

  Field& field_;
  const SmoothnessTerm& smoothness_;
  double smoothness_weight_, normal_weight_, corner_weight_;
  std::vector<UnitNormal> measured_;
  std::vector<float> areas_;  ///< relative to the mean

  struct Pair {
    Index face0 = 0, face1 = 0;
    std::array<Index, 3> way{};    ///< edges crossed, unused ones kNone
    std::array<Index, 4> other{};  ///< the same the other way round; all kNone where that is closed
  };
  std::vector<Pair> pairs_;
  std::vector<float> pair_weights_;
  std::vector<Neighbor> neighbors_;  ///< across corners, face after face
  std::vector<std::size_t> starts_;
};

}  // namespace crease
