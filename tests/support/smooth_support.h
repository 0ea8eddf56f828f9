#pragma once

#include <span>

#include "core/energy/terms.h"
#include "core/measure/measure.h"

namespace crease::test {

/// A field in general position: vertices moved randomly by up to a tenth of an edge, random labels in [0, 1].
Field shaken_field(const Mesh& mesh, const Topology& topology, unsigned seed);

/// A field and its energy, which know each other's state.
struct FieldWithEnergy {
  FieldWithEnergy(Field start, const MrfOptions& options, std::span<const double> vertex_weights = {});
  FieldWithEnergy(const FieldWithEnergy&) = delete;

  /// After positions or labels were set.
  void update();
  Energy energy() { return terms.energy(field, weights(), alone); }
  const Weights& weights() const { return terms.final_weights(); }

  Field field;
  EnergyTerms terms;
  ThreadTeam alone{1};
};

/// E of a field as it is.
Energy energy_of(const Field& field, const MrfOptions& options, std::span<const double> vertex_weights = {});

/// Smooths `noisy` and measures the result against the original.
Measurement measure_smoothed(const Mesh& noisy, const Mesh& original, const MrfOptions& options);

}  // namespace crease::test
