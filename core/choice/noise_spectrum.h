#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/choice/lazy_walk.h"

namespace crease {

/// Noise as a sum of white noises that were smoothed by a lazy walk: number k by `kSteps[k]` steps.
struct NoiseSpectrum {
  static constexpr std::array<int, 8> kSteps = {0, 1, 2, 4, 8, 16, 32, 64};
  std::array<double, kSteps.size()> variances{};  ///< of each part, in ℓ²
  double finest = 0;                              ///< spectral density of the finest band, in ℓ²

  double sigma() const;
  /// Correlation length in edges; coarse, because the widest bands hold some of the shape, too.
  double length() const;
  /// Noise of this spectrum, one number for each vertex.
  std::vector<double> sample(const LazyWalk& walk, std::size_t vertices, std::uint32_t seed) const;
};

/// Looks for noise that is correlated over several edges, as that of scanners is. Bands of the surface, W^t (I − W^t)²
/// x along the normals of W^t x, have energies; divided by those of white noise through the same filters on the same
/// mesh they are the spectral density of the noise. That of white noise is flat, that of correlated noise rises and
/// levels off, and that of a shape rises on and on. None where the noise reads as white, or nothing reads as noise,
/// unless `force`.
std::optional<NoiseSpectrum> find_correlated_noise(const Surface& surface, bool force, ThreadTeam& team);

}  // namespace crease
