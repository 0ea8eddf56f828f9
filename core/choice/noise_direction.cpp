#include "core/choice/noise_direction.h"

#include <algorithm>
#include <cmath>

#include "core/choice/noise_direction_table.h"

namespace crease {

DirectionOdds::Numbers direction_numbers(const NoiseLevel& level, double sigma) {
  constexpr double kLeastNoise = 1e-4, kHardlyAny = 0.01, kUsualFolds = 0.05, kLongestTail = 12, kLargestQuartile = 6;
  constexpr double kMargin = 0.05;
  const WithinSurface& within = level.within;
  const double square = within.sigma * within.sigma;
  const double excess = std::log(std::max(kLeastNoise, within.sigma) / std::max(kLeastNoise, sigma)) + kMargin;
  return {std::min(0.0, excess),
          std::max(0.0, excess),
          std::log(sigma + kHardlyAny),
          std::log(level.folded_share / (square + kLeastNoise) + kUsualFolds),
          within.quantiles[0],
          within.quantiles[1],
          std::min(kLargestQuartile, within.quantiles[2]),
          std::min(kLongestTail, within.quantiles[3]),
          within.alikeness};
}

NoiseDirection direction_of(const DirectionOdds& model, const DirectionOdds::Numbers& numbers) {
  constexpr double kLeastOfIsotropic = 0.3, kMostOfNormal = -2;
  constexpr double kFarShort = 0.58;  // an irregular sampling, and noise along the normals that is twice as large
  if (numbers[0] < -kFarShort) return NoiseDirection::kNormal;
  const double odds = model.log_odds(numbers);
  if (odds > kLeastOfIsotropic) return NoiseDirection::kIsotropic;
  return odds < kMostOfNormal ? NoiseDirection::kNormal : NoiseDirection::kUnsure;
}

NoiseDirection seen_direction(const NoiseLevel& level, double sigma) {
  constexpr double kMuchSpread = 0.6;
  const NoiseDirection told = direction_of(kFittedDirectionOdds, direction_numbers(level, sigma));
  const bool must_open = level.has_folds() && level.within.sigma > kMuchSpread * sigma;
  return told == NoiseDirection::kNormal && must_open ? NoiseDirection::kUnsure : told;
}

const DirectionOdds kFittedDirectionOdds = kFittedDirections;

}  // namespace crease
