#pragma once

#include <functional>

#include "core/classical/classical.h"
#include "core/classical/surface.h"

namespace crease {

/// One iteration of a method; false when there is nothing left to gain.
using ClassicalStep = std::function<bool()>;

/// Each makes the iterations of one method over `surface`, which must outlive them.
ClassicalStep make_step(Surface& surface, const FuzzyVectorMedianOptions& options);
ClassicalStep make_step(Surface& surface, const TaubinOptions& options);
ClassicalStep make_step(Surface& surface, const MeanCurvatureFlowOptions& options);
ClassicalStep make_step(Surface& surface, const AnisotropicFlowOptions& options);
ClassicalStep make_step(Surface& surface, const NormalDiffusionOptions& options);
ClassicalStep make_step(Surface& surface, const NonIterativeOptions& options);
ClassicalStep make_step(Surface& surface, const BilateralOptions& options);
ClassicalStep make_step(Surface& surface, const DiebelOptions& options);

}  // namespace crease
