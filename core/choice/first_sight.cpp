#include "core/choice/first_sight.h"

#include <algorithm>
#include <cmath>

#include "core/choice/noise_direction.h"
#include "core/choice/noise_level.h"

namespace crease {
namespace {

constexpr int kTrialStages = 5, kTrialSteps = 20;
constexpr int kStepsOfRegular = 25;    ///< what is folded over takes longer
constexpr int kStepsOfDiffusion = 12;  ///< of a stage; each has a small part of the way to go
constexpr double kLeastVariance = 1e-6;
constexpr double kLeastImpulses = 0.004;     ///< share of the vertices
constexpr double kFarAbove = 1.5;            ///< the noise that quadrics see, which take few impulses for outliers
constexpr double kLeastIrregularity = 0.15;  ///< in ℓ; less would move vertices across creases
/// With fewer, noise cannot be told from shape: the estimate takes coarse prisms for noise and flattens them.
constexpr std::size_t kFewestVertices = 40;

/// Deviation over all vertices of impulsive noise that spares most of them. Impulses beside others do not stand out
/// alone, nor do weak ones.
double sigma_of(const LoneImpulses& impulses) {
  constexpr double kNeighbors = 6, kStrongEnough = 0.6;
  constexpr int kRounds = 8;
  double share = 0;
  for (int round = 0; round < kRounds; ++round) {
    share = std::min(0.5, impulses.share / kStrongEnough / std::pow(1 - share, kNeighbors));
  }
  return std::sqrt(share) * impulses.rms;
}

/// Whether vertices are as far from the mean of their neighbours, within the surface, as Gaussian noise leaves them. An
/// irregular sampling, which may have noise along the normals alone, has longer tails, or none.
bool looks_like_noise_within(const NoiseLevel& level) {
  constexpr double kShortest = 2.9, kLongest = 4.2;
  return level.within.tail() > kShortest && level.within.tail() < kLongest;
}

}  // namespace

GraduatedOptions FirstSight::options(const Setting& setting, double noise_variance, bool trial) const {
  GraduatedOptions options = base;
  options.family = setting.family;
  if (isotropic || !regular) options.family.ramp = 1;
  options.weight = static_cast<float>(setting.weight);
  options.variance = static_cast<float>(noise_variance);
  if (evens_sampling) {
    const double of_sampling = sigma_tangential * sigma_tangential - noise_variance;
    options.irregularity =
        static_cast<float>(std::sqrt(std::max(kLeastIrregularity * kLeastIrregularity, of_sampling)));
  }
  const bool diffuses = options.family.diffuses_throughout();
  if (trial && !diffuses) options.stages = kTrialStages;
  if (trial) {
    options.steps = kTrialSteps;
  } else if (regular) {
    options.steps = kStepsOfRegular;
  }
  if (diffuses && regular) options.steps = kStepsOfDiffusion;
  options.goes_on = regular && direction == NoiseDirection::kNormal && noise_variance < kStrongNoise * kStrongNoise;
  return options;
}

FirstSight look_at(const Surface& surface, std::optional<double> sigma, std::optional<NoiseDirection> direction,
                   ThreadTeam& team) {
  const NoiseLevel level = estimate_noise_level(surface, team);
  FirstSight sight;
  const bool is_estimable = surface.measured.size() >= kFewestVertices;
  sight.has_lone_impulses = is_estimable && !sigma && level.impulses.share > kLeastImpulses;
  const double of_impulses = sight.has_lone_impulses ? sigma_of(level.impulses) : 0;
  sight.impulses_tell_sigma = of_impulses > kFarAbove * level.sigma;
  const double estimate = sight.impulses_tell_sigma ? of_impulses : level.sigma;
  sight.sigma = sigma.value_or(is_estimable ? estimate : 0);
  sight.variance = std::max(kLeastVariance, sight.sigma * sight.sigma);
  sight.direction = direction.value_or(seen_direction(level, estimate));
  sight.regular = !level.has_folds();
  sight.isotropic = sight.direction == NoiseDirection::kIsotropic;
  sight.sigma_tangential = level.within.sigma;
  sight.folded_share = level.folded_share;
  if (sight.direction == NoiseDirection::kUnsure) sight.base.across = 2;
  sight.evens_sampling = sight.isotropic && looks_like_noise_within(level);
  if (sight.isotropic) sight.base.across = sight.evens_sampling ? 1 : level.within.sigma > 0.22 ? 0.3F : 0.5F;
  sight.base.across_start = std::min(sight.regular ? 6.0F : 3.0F, sight.base.across);
  sight.base.fading_area_start = sight.regular ? 0.4F : 0.3F;
  if (sight.isotropic) sight.base.fold_weight = 10;
  if (sight.isotropic && level.within.sigma > 0.3) sight.base.fold_area = 0.5F;
  return sight;
}

}  // namespace crease
