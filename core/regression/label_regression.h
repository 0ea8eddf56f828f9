#pragma once

#include <span>
#include <vector>

#include "core/base/thread_team.h"
#include "core/graduated/flat_mesh.h"
#include "core/regression/label_features.h"

namespace crease {

/// The probability that an edge of `mesh` is a ridge, a dihedral angle over 25° in the surface without noise, per edge.
/// The same bits for any number of threads.
std::vector<float> regressed_labels(const FlatMesh& mesh, const LabelFeatures& features, ThreadTeam& team);

}  // namespace crease
