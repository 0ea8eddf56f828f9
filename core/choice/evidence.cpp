#include "core/choice/evidence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/choice/families.h"
#include "core/choice/noise_field.h"

namespace crease {
namespace {

/// Of the reference under strong noise; 0.1 to 0.24 for half of the training pairs.
constexpr double kUsualDivergence = 0.16;

/// Mean of the squared residuals, each times its precision.
double weighted_square(std::span<const float> residuals, std::span<const float> precisions) {
  double sum = 0;
  for (std::size_t v = 0; v < residuals.size(); ++v) {
    sum += static_cast<double>(residuals[v] * residuals[v] * precisions[v]);
  }
  return sum / static_cast<double>(residuals.size());
}

class Gathering {
 public:
  Gathering(const FlatMesh& mesh, const FirstSight& sight, std::span<const float> precisions,
            const ChoiceOptions& options, const Solve& solve, bool leave_out_border)
      : mesh_(mesh),
        given_precisions_(precisions),
        options_(options),
        solve_(solve),
        leave_out_border_(leave_out_border) {
    evidence_.sight = sight;
    evidence_.variance = sight.variance;
    evidence_.precisions.assign(precisions.begin(), precisions.end());
  }

  Evidence run() {
    solve_reference();
    if (!options_.noise_sigma) refine_variance();
    find_varying_noise();
    decide_on_impulses();
    return std::move(evidence_);
  }

 private:
  /// Without a probe: the response to strong noise is known well enough.
  void solve_reference() {
    evidence_.reference = solve_setting(kReference, mesh_, evidence_, solve_, leave_out_border_);
    evidence_.reference.divergence = kUsualDivergence;
  }

  void probe_reference() {
    if (is_probed_) return;
    is_probed_ = true;
    const Candidate& reference = evidence_.reference;
    probe(evidence_.reference,
          {mesh_, evidence_.sight.options(kReference, reference.variance, true), evidence_.precisions,
           reference.variance, options_.seed, leave_out_border_},
          solve_);
  }

  Candidate tried(const Setting& setting) const {
    return try_setting(setting, mesh_, evidence_, options_, solve_, leave_out_border_);
  }

  // --- the level of the noise ---

  /// Strong noise is as strong as the residuals of the reference say. What looks like weak noise may be shape.
  void refine_variance() {
    constexpr double kWeakNoise = 0.15, kLeast = 0.7, kMost = 1.1, kFollowsNoise = 0.25, kFarBelow = 0.72, kMuch = 0.1;
    const Candidate& reference = evidence_.reference;
    const double before = evidence_.variance;
    if (evidence_.sight.impulses_tell_sigma) {
      evidence_.variance = reference.noise_variance();
      return;
    }
    const bool is_strong = evidence_.sight.sigma >= kWeakNoise;
    if (is_strong && reference.residual > kLeast * before && reference.residual < kMost * before) {
      evidence_.variance = reference.noise_variance();
      return;
    }
    probe_reference();
    if (is_strong && reference.divergence < kFollowsNoise && reference.cross_validation() > kFarBelow * before) {
      evidence_.variance = reference.noise_variance();
      return;
    }
    const std::array<Candidate, 3> views = looked_at();
    if (looks_like_shape(views)) {
      follow_variance(views);
    } else {
      // Of flat parts under weak noise the residuals say too little.
      evidence_.variance =
          is_strong ? reference.noise_variance() : std::min(before, most_valid(views).cross_validation());
    }
    if (std::abs(evidence_.variance / before - 1) > kMuch) solve_reference_again();
  }

  void solve_reference_again() {
    evidence_.reference = tried(kReference);
    is_probed_ = true;
  }

  /// The reference, and two that smooth less, as the noise is now thought to be.
  std::array<Candidate, 3> looked_at() const {
    constexpr double kDetailed = 0.12, kHardlySmoothed = 0.7;
    const bool solved = evidence_.reference.variance == evidence_.variance;
    return {solved ? evidence_.reference : tried(kReference), tried({kOrganicFamily, kDetailed}),
            tried({kOrganicFamily, kHardlySmoothed})};
  }

  static const Candidate& most_valid(const std::array<Candidate, 3>& views) {
    return *std::ranges::min_element(views, {}, &Candidate::cross_validation);
  }

  /// Whether less noise than assumed explains the upload, or the less is smoothed, the better.
  bool looks_like_shape(const std::array<Candidate, 3>& views) const {
    constexpr double kFarBelow = 0.72, kBelow = 0.9, kFarBetter = 1.3;
    const double detailed = views[1].cross_validation(), hardly_smoothed = views[2].cross_validation();
    return most_valid(views).cross_validation() < kFarBelow * evidence_.variance ||
           (hardly_smoothed < kBelow * evidence_.variance && detailed > kFarBetter * hardly_smoothed);
  }

  /// Goes down to the least noise that explains the upload about as well as any, round by round as long as that is much
  /// less. What remains of weak noise after a long way down counts as none: nothing is won by removing it.
  void follow_variance(std::array<Candidate, 3> views) {
    constexpr double kAsWell = 1.3, kTooFar = 3, kMuchLess = 0.55, kLongWay = 0.12, kWeak = 0.035 * 0.035;
    constexpr int kMostRounds = 12;
    const double first = evidence_.variance;
    for (int round = 0; round < kMostRounds; ++round) {
      if (round > 0) views = looked_at();
      const double validation = most_valid(views).cross_validation();
      if (round > 0 && validation > kTooFar * evidence_.variance) {
        evidence_.variance = validation;
        return;
      }
      double least = std::numeric_limits<double>::infinity();
      for (const Candidate& view : views) {
        if (view.cross_validation() <= kAsWell * validation) least = std::min(least, view.noise_variance());
      }
      if (round > 0 && !(least < kMuchLess * evidence_.variance)) return;
      evidence_.variance = std::min(least, evidence_.variance);
      if (evidence_.variance < std::min(kWeak, kLongWay * first)) {
        evidence_.variance = kNoVariance;
        return;
      }
    }
  }

  // --- noise whose strength varies over the surface ---

  void find_varying_noise() {
    constexpr double kSpread = 0.08, kImpulsiveSpread = 0.15, kLargestDivergence = 0.6, kLeastGain = 0.03;
    if (!given_precisions_.empty() || options_.noise_sigma || evidence_.sight.has_lone_impulses) return;
    const Candidate& before = evidence_.reference;
    NoiseField field = estimate_noise_field(mesh_, before.residuals);
    evidence_.noise_spread = field.spread;
    if (field.spread <= (before.result.latent.impulsive ? kImpulsiveSpread : kSpread)) return;
    probe_reference();
    if (before.divergence >= kLargestDivergence || is_shape()) return;

    const double uniform_variance = evidence_.variance, freedom = 1 - before.divergence;
    std::vector<float> residuals = before.residuals;
    for (int round = 0; round < 2; ++round) {
      const std::vector<float> precisions = field.precisions();
      evidence_.variance = weighted_square(residuals, precisions) / freedom;
      const GraduatedResult result = solve_(
          {mesh_, mesh_.measured, evidence_.sight.options(kReference, evidence_.variance, true), precisions, {}});
      residuals = products(difference(result.positions, mesh_.measured), result.vertex_normals);
      field = estimate_noise_field(mesh_, residuals);
    }
    const Candidate uniform = tried(kReference);  // uniform noise of the same variance, to compare with
    evidence_.precisions = field.precisions();
    Candidate varied = tried(kReference);
    const double to_beat = std::max(before.cross_validation(), uniform.cross_validation());
    evidence_.varying = std::log(varied.cross_validation()) < std::log(to_beat) - kLeastGain;
    if (evidence_.varying) {
      evidence_.variance = varied.noise_variance();
      evidence_.reference = std::move(varied);
    } else {
      evidence_.variance = uniform_variance;
      evidence_.precisions.clear();
    }
  }

  /// Whether the residuals are shape rather than noise: a setting that hardly smooths does far better.
  bool is_shape() const {
    constexpr double kFarBetter = 0.7;
    const Candidate hardly_smoothed = tried({kOrganicFamily, 1.6});
    return hardly_smoothed.cross_validation() < kFarBetter * evidence_.reference.cross_validation();
  }

  void decide_on_impulses() {
    constexpr double kMostOfIt = 0.7;
    const bool impulsive = evidence_.reference.result.latent.impulsive;
    const bool is_known = evidence_.varying || evidence_.sight.has_lone_impulses;
    evidence_.impulsive = impulsive && (is_known || evidence_.variance > kMostOfIt * evidence_.sight.variance);
    if (impulsive && !evidence_.impulsive) evidence_.sight.base.latent_variance = false;
  }

  const FlatMesh& mesh_;
  std::span<const float> given_precisions_;
  const ChoiceOptions& options_;
  const Solve& solve_;
  bool leave_out_border_;
  Evidence evidence_;
  bool is_probed_ = false;  ///< the reference
};

}  // namespace

void probe(Candidate& candidate, const ProbedSolve& solved, const Solve& solve) {
  const float step = 0.1F * static_cast<float>(std::sqrt(solved.variance));
  const std::vector<float> signs = random_signs(solved.mesh.vertex_count, solved.seed);
  const FlatVectors positions =
      probed_positions(solved.mesh, candidate.result.vertex_normals, solved.precisions, signs, step);
  const GraduatedResult response =
      solve({solved.mesh, positions, solved.options, solved.precisions, candidate.result.latent.precision});
  score_response(candidate, {solved.mesh, response.positions, signs, solved.precisions, step, solved.leave_out_border});
}

Candidate solve_setting(const Setting& setting, const FlatMesh& mesh, const Evidence& evidence, const Solve& solve,
                        bool leave_out_border) {
  Candidate candidate;
  candidate.variance = evidence.variance;
  const GraduatedOptions options = evidence.sight.options(setting, evidence.variance, true);
  candidate.result = solve({mesh, mesh.measured, options, evidence.precisions, {}});
  score_residuals(candidate, mesh, evidence.precisions, leave_out_border);
  return candidate;
}

Candidate try_setting(const Setting& setting, const FlatMesh& mesh, const Evidence& evidence,
                      const ChoiceOptions& options, const Solve& solve, bool leave_out_border) {
  Candidate candidate = solve_setting(setting, mesh, evidence, solve, leave_out_border);
  probe(candidate,
        {mesh, evidence.sight.options(setting, evidence.variance, true), evidence.precisions, evidence.variance,
         options.seed, leave_out_border},
        solve);
  return candidate;
}

Evidence gather_evidence(const FlatMesh& mesh, const FirstSight& sight, std::span<const float> precisions,
                         const ChoiceOptions& options, const Solve& solve, bool leave_out_border) {
  return Gathering(mesh, sight, precisions, options, solve, leave_out_border).run();
}

double spread_varying_noise(const FlatMesh& mesh, const Evidence& evidence, const Solve& solve,
                            std::vector<float>& precisions) {
  double variance = evidence.variance;
  const double freedom = std::max(0.05, 1 - evidence.reference.divergence);
  precisions.clear();
  for (int round = 0; round < 2; ++round) {
    const GraduatedOptions options = evidence.sight.options(kReference, variance, false);
    const GraduatedResult result = solve({mesh, mesh.measured, options, precisions, {}});
    const std::vector<float> residuals = products(difference(result.positions, mesh.measured), result.vertex_normals);
    precisions = estimate_noise_field(mesh, residuals).precisions();
    variance = weighted_square(residuals, precisions) / freedom;
  }
  return variance;
}

}  // namespace crease
