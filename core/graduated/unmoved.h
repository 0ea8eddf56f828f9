#pragma once

#include <span>

#include "core/base/thread_team.h"
#include "core/graduated/flat_mesh.h"

namespace crease {

/// `positions`, from which impulsive noise was removed, with the vertices that the noise left alone put back where they
/// were measured. A mixture of two variances of the residuals tells which they are. The descent moved them by its own
/// error, which the vertices between share, so these move by the mean of their neighbours. Nothing changes where the
/// variances are less than a hundredfold apart: such noise spares no vertex. `amount`, 0 to 1, scales all moves.
FlatVectors with_unmoved_put_back(const FlatMesh& mesh, const FlatVectors& positions, std::span<const float> measured,
                                  float amount, ThreadTeam& team);

}  // namespace crease
