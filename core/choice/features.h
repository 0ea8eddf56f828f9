#pragma once

#include <array>

#include "core/choice/evidence.h"

namespace crease {

/// Numbers that tell surfaces apart: what is known of the noise, how the normals of a candidate bend over edges and
/// over patches, what its ridges are like, and what its residuals look like.
inline constexpr std::size_t kFeatures = 43;
using Features = std::array<double, kFeatures>;

Features features_of(const FlatMesh& mesh, const Evidence& evidence, const Candidate& candidate);

}  // namespace crease
