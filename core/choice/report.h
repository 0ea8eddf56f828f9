#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace crease {

enum class NoiseDirection {
  kNormal,     ///< along the normals
  kUnsure,     ///< partly within the surface, or sampling that is irregular
  kIsotropic,  ///< in all directions
};

constexpr std::array<std::string_view, 3> words_of(NoiseDirection) { return {"normal", "unsure", "isotropic"}; }

/// A setting that was considered.
struct CandidateReport {
  std::string family;
  double weight = 0;          ///< its own; the chosen one may be solved with another
  double expected_error = 1;  ///< of the normals, over that of the chosen one
};

/// What was estimated and chosen.
struct ChoiceReport {
  std::size_t faces = 0;         ///< that it was made for
  double noise_sigma_first = 0;  ///< at first sight
  double noise_sigma = 0;        ///< after the reference has been solved; in ℓ
  NoiseDirection direction = NoiseDirection::kNormal;
  bool impulsive = false;
  double moved_share = 1;         ///< impulsive: of the vertices
  bool varying = false;           ///< over the surface
  double noise_spread = 0;        ///< variance of the logarithm of the local noise variance
  double correlation_length = 0;  ///< in edges; 0 for noise that is independent from vertex to vertex
  std::size_t spikes = 0;         ///< vertices that were flattened before anything was estimated
  std::string family;
  double weight = 0;  ///< of the likelihood, in units of one over the noise variance; strength 1
  double margin =
      0;  ///< by how much the error is expected to be larger with the best setting for another kind of surface
  std::vector<CandidateReport> candidates;
};

}  // namespace crease
