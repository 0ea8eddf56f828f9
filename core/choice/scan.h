#pragma once

#include <span>

#include "core/choice/choice.h"
#include "core/choice/noise_spectrum.h"

namespace crease {

/// Beyond, the factorisations take too much memory.
inline constexpr std::size_t kMostFacesOfScan = 1'000'000;

/// Removes noise that is correlated over several edges. One weight of the likelihood carries it, far below that for
/// white noise of the same strength. Weights are tried downwards, each solve starting from the last. Two things choose
/// among them: Stein's unbiased risk estimate for the slopes of the smoothed residuals, with probes drawn from the
/// spectrum, and how flat the surface comes out. The response of a result comes from one factorisation instead of a
/// second solve. Sets what the report says of weights and noise.
ChoiceResult remove_correlated_noise(const Surface& surface, const FlatMesh& mesh, const NoiseSpectrum& spectrum,
                                     const ChoiceOptions& options, const Solve& solve, ChoiceReport& report,
                                     ThreadTeam& team);

}  // namespace crease
