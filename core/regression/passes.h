#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "core/base/thread_team.h"
#include "core/graduated/flat_mesh.h"
#include "core/regression/normal_features.h"

namespace crease {

constexpr std::size_t kPasses = 2;

/// What has become of the positions of a descent, and unit normals that the faces should have.
struct Turned {
  FlatVectors positions, normals;
};

/// Passes over a result, each with a network of its own: a regression says where the faces should look, and they turn
/// there. The first sees what a descent made of the upload beside `reference`, the positions of another result or
/// empty; the next what the faces could be turned to beside where they should have looked. `amount` is as in
/// regressed_normals, `precisions` as in turned_towards; `passes` of `kPasses`. The same bits for any number of
/// threads. `on_step` is called on this thread before faces are looked at and before they turn, and may throw to end
/// it.
Turned turned_in_passes(
    const FlatMesh& mesh, const FlatVectors& positions, std::span<const float> reference, const DescentSight& sight,
    float amount, std::span<const float> precisions, std::size_t passes, ThreadTeam& team,
    const std::function<void()>& on_step = [] {});

}  // namespace crease
