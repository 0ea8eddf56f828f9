#pragma once

#include <span>

#include "core/base/thread_team.h"
#include "core/graduated/flat_mesh.h"

namespace crease {

/// A vertex within the surface: where it is now, where it was measured, and the unit normal there.
struct SamplingView {
  const FlatMesh& mesh;
  std::span<const float> positions, measured, normals;
};

/// How far each vertex is to move within the surface, a vector across its normal, so that it comes to lie near the mean
/// of its neighbours: the least squares of the way from where it was measured, over the variance of the noise, and of
/// the way from that mean, over what it is where there is no noise. `ratio` is the first variance over the second.
/// Isotropic noise hides the sampling of a surface as it hides its shape, and samplings are smooth.
FlatVectors evening_moves(const SamplingView& view, float ratio, ThreadTeam& team);

}  // namespace crease
