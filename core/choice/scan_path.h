#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/choice/choice.h"
#include "core/choice/lazy_walk.h"
#include "core/choice/noise_spectrum.h"
#include "core/choice/scan_error.h"
#include "core/graduated/hinge_metric.h"

namespace crease {

/// Solves a scan for one weight of the likelihood after the other, with flats whose scale is far below any facet. The
/// metric of its searches is factorised, so that low frequencies move as fast as high ones.
class ScanPath {
 public:
  /// All must outlive the object.
  ScanPath(const Surface& surface, const FlatMesh& mesh, const NoiseSpectrum& spectrum, std::uint32_t seed,
           const Solve& solve, ThreadTeam& team);

  /// From `start`, or through all stages from the measured positions. The weight is in one over the noise variance.
  GraduatedResult solved(double weight, std::span<const float> start) const;
  /// Stein's unbiased estimate of how wrong the slopes of the smoothed residuals are, the mean of its roots over
  /// patches, with probes drawn from the spectrum. The response of the result comes from one factorisation instead of a
  /// second solve.
  double risk_of(const GraduatedResult& result, double weight);

 private:
  std::vector<double> products_of_slopes(const FourFields& a, const FourFields& b, double factor) const;
  std::vector<float> second_derivatives(const FlatVectors& positions) const;

  const FlatMesh& mesh_;
  const Solve& solve_;
  double variance_;  ///< of the noise
  LazyWalk walk_;
  mutable HingeMetric metric_;  ///< made anew wherever it is used
  FourFields probes_;           ///< in all but the first
  std::vector<double> noise_;   ///< products of slopes of the noise itself
};

/// The results for the telling weights, and what they tell.
struct ScanTrial {
  std::vector<FlatVectors> positions;
  ScanFeatures features{};
};
ScanTrial try_scan(ScanPath& path, const FlatMesh& mesh, const NoiseSpectrum& spectrum);

}  // namespace crease
