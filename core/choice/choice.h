#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/thread_team.h"
#include "core/choice/families.h"
#include "core/choice/report.h"
#include "core/geometry/surface.h"
#include "core/graduated/descent.h"
#include "core/regression/normal_features.h"

namespace crease {

/// What a user may fix; the rest is estimated.
struct ChoiceOptions {
  double strength = 1;                ///< times the deviation of the noise, for the likelihood; above 0
  std::optional<double> noise_sigma;  ///< in ℓ
  std::optional<NoiseDirection> noise_direction;
  bool correlated = false;                  ///< take the noise for correlated, whatever it looks like
  std::optional<std::string_view> surface;  ///< the name of families in core/choice/families.h
  std::uint32_t seed = 1;
  bool wants_risk = false;  ///< of the result
};

/// Solves for positions; may answer from memory. Numbers of solves count from 0 in an order that only depends on the
/// upload and the options.
struct SolveRequest {
  const FlatMesh& mesh;
  std::span<const float> measured;
  GraduatedOptions options;
  std::span<const float> precisions, latent;
  bool final = false;  ///< one of those that the result is made of
};
using Solve = std::function<GraduatedResult(const SolveRequest&)>;

struct ChoiceResult {
  Setting setting;                  ///< that was chosen, with its own weight (see core/choice/weight.h)
  FlatVectors positions;            ///< of the whole mesh
  FlatVectors reference_positions;  ///< by the reference, which does not merge ridges; none for scans and large meshes
  /// Expected squared error of the positions along the normals, in noise variances; if it is wanted, and known.
  std::optional<double> risk;
};

/// What the regression of normals is told.
DescentSight sight_of(const Setting& setting, const ChoiceReport& report);

/// The automatic setting: solves a reference, learns from it what the noise and the surface are like, and solves the
/// setting that is expected to do best. `precisions` of the likelihood per vertex, empty for 1.
ChoiceResult choose_and_solve(const Surface& surface, const FlatMesh& mesh, std::span<const float> precisions,
                              const ChoiceOptions& options, const Solve& solve, ChoiceReport& report, ThreadTeam& team);

}  // namespace crease
