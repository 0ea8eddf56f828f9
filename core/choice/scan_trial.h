#pragma once

#include <span>

#include "core/base/thread_team.h"
#include "core/choice/choice.h"
#include "core/choice/families.h"
#include "core/choice/noise_spectrum.h"
#include "core/choice/scan_error.h"
#include "core/graduated/hinge_metric.h"

namespace crease {

/// Solves settings for scans. The metric of its searches is factorised, so that low frequencies, which noise of
/// scanners has most of, move as fast as high ones.
class ScanSolver {
 public:
  /// `precisions` of the likelihood per vertex, relative; empty for 1. All must outlive the object.
  ScanSolver(const FlatMesh& mesh, std::span<const float> precisions, const NoiseSpectrum& spectrum, const Solve& solve,
             ThreadTeam& team);

  GraduatedResult solved(const Setting& setting, bool final) const;
  double variance() const { return variance_; }  ///< of the noise, in ℓ²

 private:
  const FlatMesh& mesh_;
  std::span<const float> precisions_;
  const Solve& solve_;
  double variance_;
  mutable HingeMetric metric_;  ///< made anew wherever it is used
};

/// Solves the telling settings, and looks at what they make of the mesh.
ScanFeatures try_scan(const ScanSolver& solver, const FlatMesh& mesh, const NoiseSpectrum& spectrum);

}  // namespace crease
