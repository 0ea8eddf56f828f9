#include "core/choice/choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "core/choice/blend.h"
#include "core/choice/families.h"
#include "core/choice/first_sight.h"
#include "core/choice/noise_field.h"
#include "core/choice/patches.h"

namespace crease {
namespace {

constexpr std::size_t kMostFaces = 24'000;  ///< beyond, candidates are tried on patches
constexpr std::size_t kPatchFaces = 12'000;
constexpr std::size_t kMostFacesToBlend = 150'000;
constexpr std::size_t kMostFacesForAngles = 60'000;
constexpr double kFamilyWindow = 0.06, kOrganicWindow = 0.2;  ///< how near a family must come to be looked into

/// Mean of the squared residuals, each times its precision.
double weighted_square(const std::vector<float>& residuals, const std::vector<float>& precisions) {
  double sum = 0;
  for (std::size_t v = 0; v < residuals.size(); ++v) {
    sum += static_cast<double>(residuals[v] * residuals[v] * precisions[v]);
  }
  return sum / static_cast<double>(residuals.size());
}

class Choice {
 public:
  Choice(const Surface& surface, const FlatMesh& mesh, std::span<const float> precisions, const ChoiceOptions& options,
         const Solve& solve, ChoiceReport& report)
      : surface_(surface),
        full_(mesh),
        given_precisions_(precisions),
        options_(options),
        solve_(solve),
        report_(report),
        sight_(look_at(surface, options.noise_sigma, options.noise_direction)),
        variance_(sight_.variance) {
    report_.noise_sigma_first = sight_.sigma;
    report_.direction = sight_.direction;
  }

  ChoiceResult run() {
    prepare_patches();
    try_families();
    find_varying_noise();
    std::size_t chosen = best();
    report_.impulsive =
        candidates_[chosen].result.latent.impulsive && (report_.varying || variance_ > 0.7 * sight_.variance);
    if (candidates_[chosen].result.latent.impulsive && !report_.impulsive) sight_.base.latent_variance = false;
    chosen = report_.impulsive ? best_by_deviance() : refine(chosen);
    return finish(chosen);
  }

 private:
  // --- where candidates are tried ---

  void prepare_patches() {
    if (full_.face_count > kMostFaces) {
      Patches patches = cut_patches(surface_, kPatchFaces);
      const Topology topology = build_topology(patches.mesh);
      patch_ = std::make_unique<FlatMesh>(topology, patches.mesh.triangles, patches.mesh.positions);
      for (const Index v : patches.vertices) {
        if (!given_precisions_.empty()) patch_precisions_.push_back(given_precisions_[v]);
      }
    }
    precisions_.assign(given_precisions().begin(), given_precisions().end());
    signs_ = random_signs(trial_mesh().vertex_count, options_.seed);
  }

  bool on_patches() const { return patch_ != nullptr; }
  const FlatMesh& trial_mesh() const { return on_patches() ? *patch_ : full_; }
  std::span<const float> given_precisions() const {
    return on_patches() ? std::span<const float>(patch_precisions_) : given_precisions_;
  }

  GraduatedOptions setting(const PotentialFamily& family, double weight, double variance, bool trial) const {
    const double strength = trial ? 1 : options_.strength;
    return sight_.options(family, weight / (strength * strength), variance, trial);
  }

  /// Solves a candidate on `mesh`, and again for a probe unless its residuals rule it out.
  Candidate tried(const PotentialFamily& family, double weight, const FlatMesh& mesh, std::span<const float> precisions,
                  std::span<const float> signs, double hopeless_from) {
    constexpr double kLeastDivergence = 0.03;  // of any candidate
    Candidate candidate;
    candidate.family = family;
    candidate.weight = weight;
    candidate.variance = variance_;
    const GraduatedOptions options = setting(family, weight, variance_, true);
    const bool leave_out_border = on_patches() && &mesh == patch_.get();
    candidate.result = solve_({mesh, mesh.measured, options, precisions, {}});
    score_residuals(candidate, mesh, mesh.measured, precisions, leave_out_border);
    if (!candidate.result.latent.impulsive && candidate.residual + 2 * kLeastDivergence * variance_ > hopeless_from) {
      candidate.hopeless = true;
      return candidate;
    }
    const float step = 0.1F * static_cast<float>(std::sqrt(variance_));
    const FlatVectors probed = probed_positions(mesh, candidate.result.vertex_normals, precisions, signs, step);
    const GraduatedResult response = solve_({mesh, probed, options, precisions, candidate.result.latent.precision});
    score_responses(candidate, {mesh, mesh.measured, response.positions, signs, precisions, step, leave_out_border});
    return candidate;
  }

  /// Tries a candidate where all others were tried. Without `force` it is dropped when it is hopeless.
  bool add(const PotentialFamily& family, double weight, bool force = false) {
    if (options_.family && family.name != options_.family->name) return false;
    double hopeless_from = std::numeric_limits<double>::infinity();
    for (const Candidate& other : candidates_) {
      if (!force && other.variance == variance_) {
        hopeless_from = std::min(hopeless_from, other.residual + 2 * variance_ * other.divergence);
      }
    }
    Candidate candidate = tried(family, weight, trial_mesh(), precisions_, signs_, hopeless_from);
    if (candidate.hopeless) return false;
    candidates_.push_back(std::move(candidate));
    return true;
  }

  void try_families() {
    add(kCreaseFamily, 0.1);
    add(kCurvedCreaseFamily, 0.05);
    add(kFlatFamily, 0.2);
    add(kOrganicFamily, 0.12);
    add(kOrganicFamily, 0.3);
    refine_variance();
  }

  std::size_t best_by_cross_validation() const {
    const auto place = std::ranges::min_element(candidates_, {}, &Candidate::cross_validation);
    return static_cast<std::size_t>(place - candidates_.begin());
  }

  void refine_variance() {
    if (!options_.noise_sigma) variance_ = candidates_[best_by_cross_validation()].noise_variance();
  }

  /// The risk in noise variances, with a little against families that gain by it what they should not on near ties.
  double score(const Candidate& candidate, double lowest) const {
    double prior = 0;
    if (candidate.is(kFlatFamily) || candidate.is(kSoftCreaseFamily))
      prior = sight_.regular || sight_.isotropic ? 0.04 : 0.03;
    if (candidate.is(kCreaseFamily)) prior = !sight_.regular && !sight_.isotropic ? 0.01 : lowest > 0.2 ? 0.03 : 0;
    if (candidate.is(kCurvedCreaseFamily)) prior = 0.01;
    if (candidate.is(kOrganicFamily)) prior = lowest < 0.2 ? 0.02 : 0;
    return candidate.risk(variance_) / variance_ + prior;
  }

  std::size_t best() const {
    double lowest = std::numeric_limits<double>::infinity();
    for (const Candidate& candidate : candidates_) lowest = std::min(lowest, candidate.risk(variance_) / variance_);
    const auto place =
        std::ranges::min_element(candidates_, {}, [&](const Candidate& one) { return score(one, lowest); });
    return static_cast<std::size_t>(place - candidates_.begin());
  }

  /// Impulsive noise: which mixture of residuals is the likeliest. The responses of flats are too small to compare.
  std::size_t best_by_deviance() const {
    const auto deviance = [](const Candidate& candidate) {
      if (candidate.is(kFlatFamily)) return std::numeric_limits<double>::infinity();
      return candidate.deviance + (candidate.is(kCurvedCreaseFamily) ? 0.05 : 0);
    };
    const auto place = std::ranges::min_element(candidates_, {}, deviance);
    return static_cast<std::size_t>(place - candidates_.begin());
  }

  double lowest_risk(const PotentialFamily& family) const {
    double lowest = std::numeric_limits<double>::infinity();
    for (const Candidate& one : candidates_) {
      if (one.is(family)) lowest = std::min(lowest, one.risk(variance_) / variance_);
    }
    return lowest;
  }

  // --- noise whose strength varies over the surface ---

  void find_varying_noise() {
    constexpr double kSpread = 0.08, kImpulsiveSpread = 0.15, kLargestDivergence = 0.6, kLeastGain = 0.03;
    if (!given_precisions_.empty() || options_.noise_sigma) return;
    const std::size_t first = best_by_cross_validation();
    const Candidate& before = candidates_[first];
    const FlatMesh& mesh = trial_mesh();
    NoiseField field = estimate_noise_field(mesh, before.residuals);
    report_.noise_spread = field.spread;
    if (field.spread <= (before.result.latent.impulsive ? kImpulsiveSpread : kSpread)) return;
    if (before.divergence >= kLargestDivergence || is_shape(first)) return;

    const double uniform_validation = candidates_[first].cross_validation(), uniform_variance = variance_;
    const double freedom = 1 - candidates_[first].divergence;
    const PotentialFamily family = candidates_[first].family;
    const double weight = candidates_[first].weight;
    std::vector<float> residuals = candidates_[first].residuals;
    for (int round = 0; round < 2; ++round) {
      const std::vector<float> precisions = field.precisions();
      variance_ = weighted_square(residuals, precisions) / freedom;
      const GraduatedResult result =
          solve_({mesh, mesh.measured, setting(family, weight, variance_, false), precisions, {}});
      residuals = products(difference(result.positions, mesh.measured), result.vertex_normals);
      field = estimate_noise_field(mesh, residuals);
    }
    std::vector<Candidate> uniform = std::move(candidates_);
    candidates_.clear();
    add(family, weight, true);  // uniform noise of the same variance, to compare with
    const double to_beat = std::max(uniform_validation, candidates_.front().cross_validation());
    candidates_.clear();
    precisions_ = field.precisions();
    try_families();
    report_.varying =
        std::log(candidates_[best_by_cross_validation()].cross_validation()) < std::log(to_beat) - kLeastGain;
    if (report_.varying) return;
    candidates_ = std::move(uniform);
    variance_ = uniform_variance;
    precisions_.clear();
  }

  /// Whether the residuals are shape rather than noise: a candidate that hardly smooths does far better.
  bool is_shape(std::size_t first) {
    constexpr double kFarBetter = 0.7, kHardlySmoothing = 1.6;
    const double validation = candidates_[first].cross_validation();
    if (!add(kOrganicFamily, kHardlySmoothing, true)) return false;
    const bool shape = candidates_.back().cross_validation() < kFarBetter * validation;
    candidates_.pop_back();
    return shape;
  }

  std::size_t refine(std::size_t chosen) {
    const PotentialFamily family = candidates_[chosen].family;
    const double weight = candidates_[chosen].weight;
    if (!options_.noise_sigma) follow_variance(chosen, family, weight);
    try_neighbors(chosen, family, weight);
    chosen = best();
    return climb_organic(chosen);
  }

  /// Solves the chosen candidate again with the refined variance, as long as that changes much: (nearly) clean meshes
  /// run down to no noise at all.
  void follow_variance(std::size_t& chosen, const PotentialFamily& family, double weight) {
    constexpr double kMuch = 0.06, kFall = 0.87;
    constexpr int kMostRounds = 10;
    for (int round = 0; round < kMostRounds; ++round) {
      if (std::abs(std::sqrt(variance_ / candidates_[chosen].variance) - 1) <= kMuch) return;
      const double before = candidates_[chosen].cross_validation();
      add(family, weight, true);
      chosen = candidates_.size() - 1;
      variance_ = candidates_[chosen].noise_variance();
      if (candidates_[chosen].cross_validation() > kFall * before) return;
    }
  }

  void try_neighbors(std::size_t chosen, const PotentialFamily& family, double weight) {
    const double risk = candidates_[chosen].risk(variance_) / variance_;
    const double creases = lowest_risk(kCreaseFamily), curved = lowest_risk(kCurvedCreaseFamily),
                 organic = lowest_risk(kOrganicFamily);
    if (family.name == kCreaseFamily.name) {
      add(kCreaseFamily, 0.05);
      if (curved < risk + kFamilyWindow) add(kCurvedCreaseFamily, 0.03);
    } else if (family.name == kCurvedCreaseFamily.name) {
      add(kCurvedCreaseFamily, 0.03);
      if (creases < risk + kFamilyWindow) add(kCreaseFamily, 0.05);
      if (organic < risk + kOrganicWindow) add(kOrganicFamily, 0.07);
    } else if (family.name == kFlatFamily.name) {
      add(kSoftCreaseFamily, 0.1);
    } else if (family.name == kOrganicFamily.name) {
      add(kOrganicFamily, weight < 0.2 ? 0.07 : 0.19);
    }
  }

  std::size_t climb_organic(std::size_t chosen) {
    constexpr double kFactor = 2.3, kLargestWeight = 60, kFromWeight = 0.25, kGain = 14;
    const double least_gain = kGain / std::pow(static_cast<double>(trial_mesh().vertex_count), 0.75);
    for (double weight = 0.7; weight < kLargestWeight; weight *= kFactor) {
      if (!candidates_[chosen].is(kOrganicFamily) || candidates_[chosen].weight < kFromWeight) break;
      add(kOrganicFamily, weight, true);
      if (!(candidates_.back().cross_validation() < candidates_[chosen].cross_validation() * (1 - least_gain))) {
        candidates_.pop_back();
        break;
      }
      chosen = candidates_.size() - 1;
      refine_variance();
    }
    return chosen;
  }

  // --- the result ---

  ChoiceResult finish(std::size_t chosen) {
    report(chosen);
    if (report_.varying && on_patches()) find_field_of_whole(chosen);
    const std::span<const float> precisions = !report_.varying ? given_precisions_
                                              : on_patches()   ? std::span<const float>(field_)
                                                               : precisions_;
    const std::vector<std::size_t> used = choose_blend(chosen, precisions);
    ChoiceResult result;
    const auto solved = [&](std::size_t i) {
      const Candidate& one = candidates_[i];
      return solve_(
          {full_, full_.measured, setting(one.family, one.weight, one.variance, false), precisions, {}, true});
    };
    result.positions = solved(chosen).positions;
    if (used.size() > 1) blend(used, chosen, solved, result.positions);
    for (const std::size_t i : used) report_.blended.emplace_back(candidates_[i].family.name);
    result.ridge_angles = angles(result.positions, precisions);
    return result;
  }

  void report(std::size_t chosen) {
    const Candidate& one = candidates_[chosen];
    report_.noise_sigma = std::sqrt(variance_);
    report_.family = one.family.name;
    report_.weight = one.weight;
    report_.moved_share = report_.impulsive ? 1 - one.result.latent.small_share : 1;
    double other = std::numeric_limits<double>::infinity();
    for (const Candidate& candidate : candidates_) {
      report_.candidates.push_back({std::string(candidate.family.name), candidate.weight,
                                    candidate.risk(variance_) / variance_, candidate.cross_validation(),
                                    candidate.residual, candidate.divergence});
      if (!candidate.is(one.family)) other = std::min(other, candidate.risk(variance_));
    }
    report_.margin = std::isfinite(other) ? (other - one.risk(variance_)) / variance_ : 0;
  }

  /// The noise field of the whole mesh after it was found on patches.
  void find_field_of_whole(std::size_t chosen) {
    const Candidate& one = candidates_[chosen];
    const double freedom = std::max(0.05, 1 - one.divergence);
    double variance = one.variance;
    std::vector<float> precisions;
    for (int round = 0; round < 2; ++round) {
      const GraduatedResult result =
          solve_({full_, full_.measured, setting(one.family, one.weight, variance, false), precisions, {}});
      const std::vector<float> residuals =
          products(difference(result.positions, full_.measured), result.vertex_normals);
      precisions = estimate_noise_field(full_, residuals).precisions();
      variance = weighted_square(residuals, precisions) / freedom;
    }
    field_ = std::move(precisions);
    variance_ = variance;
    for (Candidate& candidate : candidates_) candidate.variance = variance;
  }

  /// The chosen candidate and those that do better on a part of the surface.
  std::vector<std::size_t> choose_blend(std::size_t chosen, std::span<const float> precisions) {
    constexpr double kLargestDivergence = 0.7, kLeastShare = 0.05, kLeastShareOfPatches = 0.2;
    if (report_.impulsive || candidates_[chosen].divergence >= kLargestDivergence ||
        full_.face_count > kMostFacesToBlend) {
      return {chosen};
    }
    std::vector<std::size_t> used = {chosen};
    for (std::size_t i = candidates_.size(); i-- > 0;) {  // the last one of each setting knows the noise best
      const bool sharp = candidates_[i].is(kCreaseFamily) || candidates_[i].is(kFlatFamily);
      if (candidates_[chosen].is(kOrganicFamily) && sharp) continue;
      const auto same = [&](std::size_t j) { return candidates_[i].has_setting_of(candidates_[j]); };
      if (std::ranges::none_of(used, same)) used.push_back(i);
    }
    weigh(used, chosen, trial_mesh(), signs_);
    std::vector<std::size_t> kept;
    for (std::size_t j = 0; j < used.size(); ++j) {
      if (j == 0 || shares_[j] > (on_patches() ? kLeastShareOfPatches : kLeastShare)) kept.push_back(used[j]);
    }
    if (kept.size() > 1) {
      if (on_patches()) {
        signs_ = random_signs(full_.vertex_count, options_.seed);
        for (const std::size_t i : kept) {
          const Candidate& one = candidates_[i];
          const double settled = std::exchange(variance_, one.variance);
          Candidate whole =
              tried(one.family, one.weight, full_, precisions, signs_, std::numeric_limits<double>::infinity());
          variance_ = settled;
          candidates_[i].result = std::move(whole.result);
          candidates_[i].residuals = std::move(whole.residuals);
          candidates_[i].responses = std::move(whole.responses);
        }
      }
      weigh(kept, chosen, full_, signs_);
    }
    return kept;
  }

  /// Sets the weight of each candidate at each vertex, and its share of the surface.
  void weigh(const std::vector<std::size_t>& used, std::size_t chosen, const FlatMesh& mesh,
             std::span<const float> signs) {
    const bool organic = candidates_[chosen].is(kOrganicFamily);
    const float margin = 0.03F + 0.3F * std::max(0.0F, static_cast<float>(std::sqrt(variance_)) - 0.35F);
    blend_weights_.clear();
    for (const std::size_t i : used) {
      std::vector<float> risk = local_risk(candidates_[i], mesh, signs, variance_);
      const bool free =
          i == chosen || (organic && candidates_[chosen].weight > 0.25 && candidates_[i].is(kOrganicFamily));
      for (float& value : risk) value += free ? 0 : margin + (organic ? 0.03F : 0);
      blend_weights_.push_back(std::move(risk));
    }
    shares_ = weights_of_risks(blend_weights_);
  }

  template <typename Solved>
  void blend(const std::vector<std::size_t>& used, std::size_t chosen, Solved solved, FlatVectors& positions) {
    std::vector<FlatVectors> results;
    for (const std::size_t i : used) results.push_back(i == chosen ? positions : solved(i).positions);
    positions = blended(results, blend_weights_);
  }

  /// Dihedral angles of the result of flats, which does not merge ridges that lie close together; of the result itself
  /// where the mesh is large.
  std::vector<float> angles(const FlatVectors& positions, std::span<const float> precisions) {
    if (full_.face_count > kMostFacesForAngles) return dihedral_angles(full_, positions);
    if (!on_patches()) {
      for (std::size_t i = candidates_.size(); i-- > 0;) {
        if (candidates_[i].is(kFlatFamily)) return dihedral_angles(full_, candidates_[i].result.positions);
      }
    }
    return dihedral_angles(
        full_, solve_({full_, full_.measured, setting(kFlatFamily, 0.2, variance_, true), precisions, {}}).positions);
  }

  const Surface& surface_;
  const FlatMesh& full_;
  std::span<const float> given_precisions_;
  const ChoiceOptions& options_;
  const Solve& solve_;
  ChoiceReport& report_;

  FirstSight sight_;
  double variance_ = 0;  ///< of the noise, in ℓ²

  std::unique_ptr<FlatMesh> patch_;
  std::vector<float> patch_precisions_;
  std::vector<float> precisions_;  ///< of the mesh where candidates are tried
  std::vector<float> field_;       ///< of the whole mesh, where it varies and patches were tried
  std::vector<float> signs_;
  std::vector<Candidate> candidates_;
  std::vector<std::vector<float>> blend_weights_;  ///< per candidate in use, per vertex
  std::vector<double> shares_;                     ///< per candidate in use
};

}  // namespace

ChoiceResult choose_and_solve(const Surface& surface, const FlatMesh& mesh, std::span<const float> precisions,
                              const ChoiceOptions& options, const Solve& solve, ChoiceReport& report) {
  return Choice(surface, mesh, precisions, options, solve, report).run();
}

}  // namespace crease
