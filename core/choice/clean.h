#pragma once

#include "core/choice/error_model.h"
#include "core/choice/features.h"

namespace crease {

/// What looks like more noise than this, in ℓ, is never taken for shape.
inline constexpr double kMostDoubtfulNoise = 0.25;

/// How probable it is that an upload has no noise: 1 for training meshes as they are, 0 for the same with noise. A
/// coarse mesh bends from face to face as one with noise does, and quadrics fit it as badly; what the reference leaves
/// of it tells the two apart.
struct CleanModel : ErrorModel<kFeatures, 1, Kernel::kExponential> {};

/// Whether what was taken for noise is the shape of the mesh. `features` are those of the reference.
bool is_clean(const Features& features);

/// Fitted on meshes without noise and with little of it (tests/quality/fit_clean.cpp).
extern const CleanModel kFittedCleanModel;

}  // namespace crease
