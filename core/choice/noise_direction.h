#pragma once

#include "core/choice/noise_level.h"
#include "core/choice/odds_model.h"
#include "core/choice/report.h"

namespace crease {

/// Odds that noise goes in all directions rather than along the normals.
using DirectionOdds = OddsModel<9>;

/// What tells the direction: by how much the spread of vertices within the surface falls short of the noise along the
/// normals, or exceeds it, as logarithms (of noise in all directions it hardly falls short); that noise; how many faces
/// fold, for so much spread; and what the spread is like. `sigma` is the noise along the normals in ℓ.
DirectionOdds::Numbers direction_numbers(const NoiseLevel& level, double sigma);

/// Unsure where it is not clear that the noise is along the normals; to be unsure costs less than to be wrong.
NoiseDirection direction_of(const DirectionOdds& model, const DirectionOdds::Numbers& numbers);

/// What is thought of an upload whose noise along the normals is `sigma`, in ℓ. Where faces fold and vertices spread
/// within the surface, noise is never thought to be along the normals alone: thin faces must be free to open.
NoiseDirection seen_direction(const NoiseLevel& level, double sigma);

/// Fitted on meshes with noise of all kinds (tests/quality/fit_direction.cpp).
extern const DirectionOdds kFittedDirectionOdds;

}  // namespace crease
