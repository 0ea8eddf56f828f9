#include "core/choice/choice.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/choice/clean.h"
#include "core/choice/evidence.h"
#include "core/choice/expected_error.h"
#include "core/choice/families.h"
#include "core/choice/features.h"
#include "core/choice/patches.h"
#include "core/choice/ranking.h"
#include "core/choice/second_look.h"
#include "core/choice/weight.h"

namespace crease {
namespace {

constexpr std::size_t kMostFacesForReference = 60'000;  ///< that are worth another solve for the regressions' sake
constexpr double kFacesInTime = 13'000;  ///< a mesh of so many is done before anybody waits; smaller ones get more work

class Choice {
 public:
  Choice(const Surface& surface, const FlatMesh& mesh, std::span<const float> precisions, const ChoiceOptions& options,
         const Solve& solve, ChoiceReport& report, ThreadTeam& team)
      : mesh_(mesh), options_(options), solve_(solve), report_(report), patches_(cut_for_trials(surface, precisions)) {
    const FirstSight sight = look_at(surface, options.noise_sigma, options.noise_direction, team);
    evidence_ = gather_evidence(trial_mesh(), sight, on_patches() ? patches_->precisions : precisions, options, solve,
                                on_patches());
    features_ = features_of(trial_mesh(), evidence_, evidence_.reference);
    clean_ = !options.noise_sigma && sight.sigma < kMostDoubtfulNoise && is_clean(features_);
    if (clean_) forget_noise();
    precisions_.assign(precisions.begin(), precisions.end());
    if (evidence_.varying) precisions_ = evidence_.precisions;
  }

  ChoiceResult run() {
    const Setting chosen = choose();
    if (evidence_.varying && on_patches()) {
      evidence_.variance = spread_varying_noise(mesh_, evidence_, solve_, precisions_);
    }
    report_noise();
    ChoiceResult result{.setting = chosen, .positions = {}, .reference_positions = {}, .risk = {}};
    const double factor = clean_ ? 1 : weight_factor(features_);
    report_.weight *= factor;
    Setting final = chosen;
    final.weight *= factor / (options_.strength * options_.strength);
    GraduatedResult solution = solved(final, false);
    if (options_.wants_risk) result.risk = risk_of(final, solution);
    result.positions = std::move(solution.positions);
    if (mesh_.face_count <= kMostFacesForReference) {
      result.reference_positions =
          on_patches() ? solved(kReference, true).positions : evidence_.reference.result.positions;
    }
    return result;
  }

 private:
  bool on_patches() const { return patches_.has_value(); }
  const FlatMesh& trial_mesh() const { return on_patches() ? patches_->mesh : mesh_; }

  void forget_noise() {
    evidence_.variance = kNoVariance;
    evidence_.varying = evidence_.impulsive = false;
    evidence_.noise_spread = 0;
  }

  /// The setting with the smallest expected error, among those for the surface that the user names.
  Setting choose() {
    SettingErrors errors = kFittedModel.expected(features_);
    restrict_to_surface(options_.surface, kSettings, errors);
    if (!clean_) look_again(errors);
    report_ranking(kSettings, errors, 1, report_);
    return kSettings[best_of(errors)];
  }

  /// Tries the likely settings, and lets what has become of the mesh decide between them, unless the upload is all but
  /// known. The best of them is expected to be as good as the best was before.
  void look_again(SettingErrors& errors) const {
    constexpr double kKnown = 0.88;
    if (kFittedModel.familiarity(features_) > kKnown) return;
    const std::vector<std::size_t> likely = likely_settings(errors, most_tried(kSettings[best_of(errors)]));
    if (likely.size() < 2) return;
    const double lowest = errors[likely.front()];
    std::vector<double> seen;
    const auto tried = try_settings(likely, errors, trial_mesh(), evidence_, solve_);
    for (const auto& second : second_features(features_, tried)) {
      seen.push_back(kSecondLook.expected_error(second));
    }
    const double least = *std::ranges::min_element(seen);
    for (std::size_t k = 0; k < likely.size(); ++k) errors[likely[k]] = lowest + (seen[k] - least);
  }

  /// How many settings there is the time to try: with creases, which take many steps, as many as take no longer than
  /// the mesh itself or than a mesh of `kFacesInTime`.
  std::size_t most_tried(const Setting& likeliest) const {
    constexpr std::size_t kFewestFaces = 1000;
    if (likeliest.family.name == family::kOrganic) return kMostTried;
    if (mesh_.face_count < kFewestFaces) return 1;
    const double faces = std::max(kFacesInTime, static_cast<double>(mesh_.face_count));
    const auto count = static_cast<std::size_t>(faces / static_cast<double>(trial_mesh().face_count));
    return std::clamp<std::size_t>(count, 1, kMostTried);
  }

  void report_noise() {
    report_.noise_sigma_first = evidence_.sight.sigma;
    report_.noise_sigma = std::sqrt(evidence_.variance);
    report_.direction = evidence_.sight.direction;
    report_.impulsive = evidence_.impulsive;
    report_.moved_share = evidence_.impulsive ? 1 - evidence_.reference.result.latent.small_share : 1;
    report_.varying = evidence_.varying;
    report_.noise_spread = evidence_.noise_spread;
  }

  /// Whether more steps make the result better: of faces between creases, unless the noise is strong.
  bool settles_slowly(const Setting& setting) const {
    const bool has_creases = setting.family.name == family::kCreases || setting.family.name == family::kCurvedCreases;
    return has_creases && evidence_.variance < kStrongNoise * kStrongNoise;
  }

  /// How many times the usual steps a mesh has the time for: up to twice, if that takes no longer than the usual ones
  /// on `kFacesInTime` faces.
  static double more_steps(double faces) { return std::clamp(kFacesInTime / faces, 1.0, 2.0); }

  /// The same for a mesh that takes seconds.
  static double fewer_steps(double faces) {
    return std::clamp(std::pow(static_cast<double>(kFacesOfSeconds) / faces, 0.25), 0.7, 1.0);
  }

  GraduatedResult solved(const Setting& setting, bool trial) const {
    GraduatedOptions options = evidence_.sight.options(setting, evidence_.variance, trial);
    const auto faces = static_cast<double>(mesh_.face_count);
    if (!trial && settles_slowly(setting)) options.steps = static_cast<int>(options.steps * more_steps(faces));
    if (!setting.family.diffuses_throughout()) options.steps = static_cast<int>(options.steps * fewer_steps(faces));
    return solve_({mesh_, mesh_.measured, options, precisions_, {}, !trial});
  }

  /// In noise variances. A risk is the small difference of large numbers, so it takes the level of the noise from a
  /// probe of the reference.
  double risk_of(const Setting& setting, const GraduatedResult& solution) const {
    Candidate reference = evidence_.reference;
    probe(reference,
          {trial_mesh(), evidence_.sight.options(kReference, reference.variance, true), evidence_.precisions,
           reference.variance, options_.seed, on_patches()},
          solve_);
    Candidate candidate;
    candidate.result = solution;
    score_residuals(candidate, mesh_, precisions_, false);
    probe(candidate,
          {mesh_, evidence_.sight.options(setting, evidence_.variance, false), precisions_, evidence_.variance,
           options_.seed, false},
          solve_);
    return candidate.risk(reference.noise_variance()) / evidence_.variance;
  }

  const FlatMesh& mesh_;
  const ChoiceOptions& options_;
  const Solve& solve_;
  ChoiceReport& report_;

  std::optional<TrialPatches> patches_;  ///< where evidence is gathered, if not on the whole mesh
  Evidence evidence_;
  Features features_{};            ///< of the reference
  bool clean_ = false;             ///< what looks like noise is shape
  std::vector<float> precisions_;  ///< of the whole mesh
};

}  // namespace

DescentSight sight_of(const Setting& setting, const ChoiceReport& report) {
  return {.noise_sigma = report.noise_sigma,
          .correlation_length = report.correlation_length,
          .isotropy = static_cast<double>(report.direction) / static_cast<double>(NoiseDirection::kIsotropic),
          .exponent = static_cast<double>(setting.family.exponent_end),
          .weight = setting.weight};
}

ChoiceResult choose_and_solve(const Surface& surface, const FlatMesh& mesh, std::span<const float> precisions,
                              const ChoiceOptions& options, const Solve& solve, ChoiceReport& report,
                              ThreadTeam& team) {
  return Choice(surface, mesh, precisions, options, solve, report, team).run();
}

}  // namespace crease
