#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/choice/capture.h"
#include "core/choice/lazy_walk.h"

namespace crease {

/// Quantiles of the local energy of a band over those of white noise: the spectral density, in ℓ², where there is least
/// besides noise and where there is more.
struct Density {
  double low = 0, quarter = 0, half = 0, high = 0;  ///< at 0.1, 0.25, 0.5, 0.75
};

/// Noise as a sum of white noises that were smoothed by a lazy walk: number k by `kSteps[k]` steps.
struct NoiseSpectrum {
  static constexpr std::array<int, 8> kSteps = {0, 1, 2, 4, 8, 16, 32, 64};
  std::array<double, kSteps.size()> variances{};  ///< of each part, in ℓ²
  std::array<Density, 7> bands{};                 ///< of the surface, from the finest to the coarsest
  CaptureSigns capture;

  double sigma() const;
  /// Correlation length in edges; coarse, because the widest bands hold some of the shape, too.
  double length() const;
  /// Noise of this spectrum, one number for each vertex.
  std::vector<double> sample(const LazyWalk& walk, std::size_t vertices, std::uint32_t seed) const;
};

/// Looks for noise that may be correlated over several edges, as that of scanners is. Bands of the surface, W^t (I −
/// W^t)² x along the normals of W^t x, have energies; divided by those of white noise through the same filters on the
/// same mesh they are the spectral density of the noise. That of white noise is flat, that of correlated noise rises
/// and levels off, and that of a shape rises on and on. None where the noise reads as white, or nothing reads as noise,
/// unless `force`; the shape of a spectrum that is found may still pass for noise. What one camera sees has such noise
/// more often than not.
std::optional<NoiseSpectrum> find_correlated_noise(const Surface& surface, bool force, ThreadTeam& team);

}  // namespace crease
