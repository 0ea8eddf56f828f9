#pragma once

#include <optional>
#include <span>

#include "core/choice/choice.h"
#include "core/choice/noise_spectrum.h"

namespace crease {

/// Beyond, the factorisations take too much memory.
inline constexpr std::size_t kMostFacesOfScan = 1'000'000;

/// Removes noise that is correlated over several edges. What some settings make of the mesh tells which of all settings
/// is best, and whether it does better than taking the noise for independent. None where it does not, unless the
/// options want it. Sets what the report says of weights and noise.
/// `precisions` of the likelihood per vertex, relative; empty for 1.
std::optional<ChoiceResult> remove_correlated_noise(const Surface& surface, const FlatMesh& mesh,
                                                    std::span<const float> precisions, const NoiseSpectrum& spectrum,
                                                    const ChoiceOptions& options, const Solve& solve,
                                                    ChoiceReport& report, ThreadTeam& team);

}  // namespace crease
