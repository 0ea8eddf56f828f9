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

/// A candidate as the report shows it.
struct CandidateReport {
  std::string family;
  double weight = 0;
  double risk = 0;              ///< in noise variances, those of the report
  double cross_validation = 0;  ///< in ℓ²
  double residual = 0, divergence = 0;
};

/// What was estimated and chosen.
struct ChoiceReport {
  double noise_sigma_first = 0;  ///< at first sight
  double noise_sigma = 0;        ///< refined by the candidates; in ℓ
  NoiseDirection direction = NoiseDirection::kNormal;
  bool impulsive = false;
  double moved_share = 1;         ///< impulsive: of the vertices
  bool varying = false;           ///< over the surface
  double noise_spread = 0;        ///< variance of the logarithm of the local noise variance
  double correlation_length = 0;  ///< in edges; 0 for noise that is independent from vertex to vertex
  std::string family;
  double weight = 0;
  double margin = 0;  ///< between the risks of the chosen candidate and the best of another family, in noise variances
  std::vector<CandidateReport> candidates;
  std::vector<std::string> blended;  ///< families that share the surface, the chosen one first
};

}  // namespace crease
