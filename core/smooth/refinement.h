#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/base/thread_team.h"
#include "core/choice/choice.h"
#include "core/choice/report.h"
#include "core/graduated/flat_mesh.h"

namespace crease {

/// What has become of the positions of a choice once what was learnt of descents has been applied.
struct Refined {
  FlatVectors positions, normals;  ///< those that faces should have; empty where nothing was to be refined
};

/// Turns the faces to where the regression says, and puts back what impulsive noise left alone. The regression has
/// learnt from results of the usual strength, so it fades where a user wants another one. What has no noise stays as it
/// is. `precisions` are weights of the user's, empty for none. `on_step` is as in turned_in_passes.
Refined refine(const FlatMesh& mesh, const ChoiceResult& chosen, const ChoiceReport& report, double strength,
               std::span<const float> precisions, ThreadTeam& team, const std::function<void()>& on_step);

/// Per edge: what the regression of labels makes of a result, and where there is no noise, angles alone.
std::vector<float> labels_of(const FlatMesh& mesh, const Refined& refined, const ChoiceResult& chosen,
                             const ChoiceReport& report, ThreadTeam& team);

/// Per edge: the probability that it is a ridge, over 25° in the original, as its angle in radians tells; in place of
/// the angles. `noise_sigma` is in ℓ.
std::vector<float> labels_of_angles(std::vector<float> angles, double noise_sigma);

}  // namespace crease
