#pragma once

#include <cstdint>
#include <vector>

#include "core/base/state_archive.h"
#include "core/energy/gradient.h"
#include "core/solve/conjugate_gradients.h"

namespace crease {

/// Moves the positions of a field down the gradient of its energy while the labels stand still.
class Descent {
 public:
  /// `fixed` per vertex: 1 where a vertex keeps its place; empty where all may move. Field and terms must outlive the
  /// object.
  Descent(Field& field, const EnergyTerms& terms, std::vector<std::uint8_t> fixed = {});

  /// Must be called before step() when labels have changed, after EnergyTerms::labels_changed().
  void labels_changed() { search_.function_changed(); }
  /// One step to lower energy. False where there is none to be found with these labels. Normals are kept up to date.
  bool step(const Weights& weights, ThreadTeam& team);
  void exchange(StateArchive& archive) { search_.exchange(archive); }

 private:
  double evaluate(const Weights& weights, std::span<const double> x, std::span<double> gradient, ThreadTeam& team);

  Field& field_;
  std::vector<std::uint8_t> fixed_;
  EnergyGradient<double> gradient_;
  ConjugateGradients search_;
  std::vector<double> x_;
  Weights weights_;  ///< of the last step
};

}  // namespace crease
