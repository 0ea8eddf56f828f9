#pragma once

#include <span>

#include "core/base/thread_team.h"
#include "core/graduated/flat_mesh.h"

namespace crease {

/// Positions near `positions` whose faces look along `normals`, unit vectors or zero for faces that may look anywhere:
/// minimises ½ Σ_f ‖n_f − t_f‖² + A Σ_v p_v ‖x_v − y_v‖², with a fold term, by L-BFGS. `precisions` p are empty for 1.
/// The same bits for any number of threads.
FlatVectors turned_towards(const FlatMesh& mesh, const FlatVectors& positions, const FlatVectors& normals,
                           std::span<const float> precisions, ThreadTeam& team);

}  // namespace crease
