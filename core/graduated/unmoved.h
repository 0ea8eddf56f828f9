#pragma once

#include <span>

#include "core/base/thread_team.h"
#include "core/graduated/flat_mesh.h"

namespace crease {

/// `positions` after impulsive noise was removed, with those vertices put back where they were measured that the noise
/// left alone, as a mixture of two variances of the residuals tells them: what the descent has moved them by is its own
/// error, and the vertices between are moved by as much as those around them. Nothing changes where the residuals are
/// not those of noise that spares vertices: where the variances are less than a hundredfold apart. `amount` from 0
/// to 1.
FlatVectors with_unmoved_put_back(const FlatMesh& mesh, const FlatVectors& positions, std::span<const float> measured,
                                  float amount, ThreadTeam& team);

}  // namespace crease
