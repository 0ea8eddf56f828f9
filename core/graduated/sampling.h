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

/// Moves within the surface that make the sampling even again after isotropic noise: a vector across the normal for
/// each vertex, in ℓ. They minimise Σ_v ‖way from where v was measured‖² + ratio · ‖way from the mean of v's
/// neighbours‖², of both only what lies within the surface. `ratio` is the variance of the noise over that of the
/// second way without noise.
FlatVectors evening_moves(const SamplingView& view, float ratio, ThreadTeam& team);

}  // namespace crease
