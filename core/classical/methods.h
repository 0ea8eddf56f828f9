#pragma once

#include <functional>

#include "core/classical/classical.h"
#include "core/classical/surface.h"

namespace crease {

/// One iteration of a method; false when there is nothing left to gain.
using ClassicalStep = std::function<bool()>;

/// Each makes the iterations of one method over `surface`, which must outlive them. No option of the method is 0.
ClassicalStep make_fuzzy_vector_median(Surface& surface, const ClassicalOptions& options);
ClassicalStep make_taubin(Surface& surface, const ClassicalOptions& options);
ClassicalStep make_mean_curvature_flow(Surface& surface, const ClassicalOptions& options);
ClassicalStep make_anisotropic_flow(Surface& surface, const ClassicalOptions& options);
ClassicalStep make_normal_diffusion(Surface& surface, const ClassicalOptions& options);
ClassicalStep make_non_iterative(Surface& surface, const ClassicalOptions& options);
ClassicalStep make_bilateral(Surface& surface, const ClassicalOptions& options);
ClassicalStep make_diebel(Surface& surface, const ClassicalOptions& options);

}  // namespace crease
