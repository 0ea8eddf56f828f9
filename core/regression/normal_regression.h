#pragma once

#include <span>

#include "core/base/thread_team.h"
#include "core/graduated/flat_mesh.h"
#include "core/regression/normal_features.h"
#include "core/regression/normal_network.h"

namespace crease {

/// Unit normals, one per face, nearer to those of the surface without noise than those of `positions`, which are what a
/// descent made of the measured positions; zero for faces without a finite area. A regression from averages of normals,
/// as in cascaded normal regression [Wang et al. 2016], by a network that turns with the frame: it weighs the averages
/// by factors that depend on their lengths alone. `reference` is as in normal_features. `amount`, 0 to 1, is how far
/// normals go towards what it says. The same bits for any number of threads.
FlatVectors regressed_normals(const NormalNetwork& network, const FlatMesh& mesh, std::span<const float> positions,
                              std::span<const float> reference, const DescentSight& sight, float amount,
                              ThreadTeam& team);

}  // namespace crease
