#pragma once

#include <optional>
#include <span>

#include "core/choice/choice.h"
#include "core/choice/noise_spectrum.h"

namespace crease {

/// Beyond, the factorisations take too much memory.
inline constexpr std::size_t kMostFacesOfScan = 1'000'000;

/// Removes noise that is correlated over several edges. One weight of the likelihood carries it, far below that for
/// white noise of the same strength. Weights are tried downwards, each solve starting from the last; what the first of
/// them make of the mesh tells how far down to go, and whether this does better than taking the noise for independent.
/// None where it does not, unless the options want it. Sets what the report says of weights and noise.
std::optional<ChoiceResult> remove_correlated_noise(const Surface& surface, const FlatMesh& mesh,
                                                    const NoiseSpectrum& spectrum, const ChoiceOptions& options,
                                                    const Solve& solve, ChoiceReport& report, ThreadTeam& team);

}  // namespace crease
