#pragma once

#include <optional>

#include "core/base/thread_team.h"
#include "core/choice/families.h"
#include "core/choice/report.h"
#include "core/geometry/surface.h"
#include "core/graduated/descent.h"

namespace crease {

/// Deviation of noise, in ℓ, that is so strong that to stop early is to smooth.
inline constexpr double kStrongNoise = 0.4;

/// What is known before anything has been solved, and the settings of every solve that follow from it.
struct FirstSight {
  NoiseDirection direction = NoiseDirection::kNormal;
  double sigma = 0, variance = 0;  ///< of the noise; in ℓ, ℓ²
  bool regular = true;             ///< hardly any face is folded over
  bool isotropic = false;
  bool evens_sampling = false;       ///< what isotropic noise did within the surface is taken back
  bool has_lone_impulses = false;    ///< the noise spares most vertices
  bool impulses_tell_sigma = false;  ///< since what is between them tells of hardly any noise
  double sigma_tangential = 0;       ///< within the surface, of sampling included; in ℓ
  double folded_share = 0;           ///< of faces that look against the smoothed normals around them
  GraduatedOptions base;             ///< without family, weight and variance

  /// A trial is solved on a shorter schedule, but for diffusions, which would smooth less with fewer stages.
  GraduatedOptions options(const Setting& setting, double noise_variance, bool trial) const;
};

/// `sigma` and `direction` are estimated where they are not given. A mesh of fewer than 40 vertices is taken for clean.
FirstSight look_at(const Surface& surface, std::optional<double> sigma, std::optional<NoiseDirection> direction,
                   ThreadTeam& team);

}  // namespace crease
