#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/base/thread_team.h"
#include "core/choice/noise_spectrum.h"
#include "core/choice/report.h"
#include "core/graduated/descent.h"

namespace crease {

/// What the uncertainty of a result is found from.
struct EndedDescent {
  GraduatedOptions options;
  std::vector<float> precisions;          ///< that it was given, per vertex, relative; empty for 1
  std::optional<NoiseSpectrum> spectrum;  ///< of noise that is correlated
  std::uint32_t seed = 1;
  std::optional<double> risk;  ///< expected squared error along the normals, in noise variances, where it is known
};

/// Posterior standard deviation of each vertex along its normal, in ℓ; finite, and above 0 unless the noise is 0. Noise
/// that is independent from vertex to vertex: the spread of draws from the posterior, linearised where the descent
/// ended. Correlated noise: the spread of the responses to noise of its spectrum. Where Stein's unbiased risk estimate
/// says that the mean squared error is larger, because the result is also biased, half of the rest is shared out over
/// the vertices. `on_step` is called on this thread between short steps and may throw to end it.
std::vector<double> posterior_deviations(const Surface& surface, const FlatMesh& mesh, const FlatVectors& positions,
                                         const EndedDescent& descent, const ChoiceReport& report, ThreadTeam& team,
                                         const std::function<void()>& on_step);

}  // namespace crease
