#pragma once

#include <optional>

#include "core/choice/report.h"
#include "core/geometry/surface.h"
#include "core/graduated/descent.h"

namespace crease {

/// What is known before anything has been solved, and the settings of every solve that follow from it.
struct FirstSight {
  NoiseDirection direction = NoiseDirection::kNormal;
  double sigma = 0, variance = 0;  ///< of the noise; in ℓ, ℓ²
  bool regular = true;             ///< hardly any face is folded over
  bool isotropic = false;
  bool short_trials = true;  ///< the noise is weak enough to try candidates on a short schedule
  float ramp = 1;
  GraduatedOptions base;  ///< without family, weight and variance

  GraduatedOptions options(const PotentialFamily& family, double weight, double noise_variance, bool trial) const;
};

/// `sigma` and `direction` are estimated where they are not given. A mesh of fewer than 40 vertices is taken for clean.
FirstSight look_at(const Surface& surface, std::optional<double> sigma, std::optional<NoiseDirection> direction);

}  // namespace crease
