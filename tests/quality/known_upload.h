#pragma once

#include <optional>

#include "core/choice/evidence.h"
#include "core/choice/features.h"
#include "core/choice/patches.h"

namespace crease::quality {

/// What the automatic setting knows of an upload when it chooses: of a large mesh, what its patches tell.
struct KnownUpload {
  std::optional<TrialPatches> trial;
  FlatMesh mesh;  ///< that of the patches, if there are any
  Evidence evidence;
  Features features{};

  KnownUpload(const Surface& surface, const FirstSight& sight, const Solve& solve)
      : trial(cut_for_trials(surface, {})),
        mesh(trial ? trial->mesh : FlatMesh(surface)),
        evidence(gather_evidence(mesh, sight, {}, {}, solve, trial.has_value())),
        features(features_of(mesh, evidence, evidence.reference)) {}
};

}  // namespace crease::quality
