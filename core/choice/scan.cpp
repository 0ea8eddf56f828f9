#include "core/choice/scan.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/choice/families.h"
#include "core/graduated/hinge_metric.h"

namespace crease {
namespace {

constexpr double kFirstWeight = 2.5, kLeastWeight = 0.0075, kFactor = 2;
constexpr double kTellingWeight = 0.2;  ///< from here on the result tells what the surface is like
constexpr double kFarBelow = 4;         ///< the expected weight: what is not worth a try
constexpr double kLeastScanVariance = 1e-8;
constexpr std::uint32_t kProbes = 3;
constexpr int kSmoothing = 8, kPatch = 64;  ///< steps of the lazy walk

/// Flats with a scale far below any facet.
constexpr PotentialFamily kFineFlats{.name = kFlatFamily.name, .scale = 0.003F};

class Scan {
 public:
  Scan(const Surface& surface, const FlatMesh& mesh, const NoiseSpectrum& spectrum, const ChoiceOptions& options,
       const Solve& solve, ChoiceReport& report, ThreadTeam& team)
      : mesh_(mesh),
        spectrum_(spectrum),
        options_(options),
        solve_(solve),
        report_(report),
        variance_(std::max(kLeastScanVariance, spectrum.sigma() * spectrum.sigma())),
        walk_(surface, team),
        metric_(mesh, team),
        probes_(mesh.vertex_count, Eigen::Array4d::Zero()) {
    for (std::uint32_t k = 0; k < kProbes; ++k) {
      const std::vector<double> probe = spectrum.sample(walk_, mesh.vertex_count, options.seed + k);
      for (std::size_t v = 0; v < probe.size(); ++v) probes_[v][k + 1] = probe[v];
    }
    noise_ = products_of_slopes(probes_, probes_, 1.0 / kProbes);
  }

  ChoiceResult run() {
    report_.noise_sigma = spectrum_.sigma();
    report_.correlation_length = spectrum_.length();
    report_.family = kFineFlats.name;
    FlatVectors positions;
    std::vector<FlatVectors> results;
    std::optional<double> expected;
    for (double weight = kFirstWeight; weight >= kLeastWeight; weight /= kFactor) {
      if (expected && weight * kFarBelow < *expected) break;
      const GraduatedResult result = solved(weight, positions);
      positions = result.positions;
      results.push_back(positions);
      if (!expected && weight < kTellingWeight) expected = expected_weight(positions);
      report_.candidates.push_back({report_.family, weight, risk_of(result, weight)});
    }
    const std::size_t place = weigh(*expected);
    FlatVectors best = std::move(results[place]);
    report_.weight = report_.candidates[place].weight;
    if (options_.strength != 1) {
      best = solved(report_.weight / (options_.strength * options_.strength), best).positions;
    }
    ChoiceResult chosen;
    chosen.ridge_angles = dihedral_angles(mesh_, best);
    chosen.positions = std::move(best);
    return chosen;
  }

 private:
  /// The flatter a surface, the lower the best weight: a law fitted to 44 pairs of 17 models with correlated noise.
  double expected_weight(const FlatVectors& positions) const {
    constexpr double kDegree = std::numbers::pi / 180, kOfOneDegree = 0.0205, kPower = 2.5;
    constexpr auto kCap = static_cast<float>(20 * kDegree);  // what is sharper counts no more
    double sum = 0;
    for (const float angle : dihedral_angles(mesh_, positions)) sum += static_cast<double>(std::min(angle, kCap));
    const double mean = sum / static_cast<double>(std::max<std::size_t>(1, mesh_.edge_count)) / kDegree;
    return std::clamp(kOfOneDegree * std::pow(mean, kPower), kLeastWeight, kFirstWeight);
  }

  /// The candidate with the least logarithm of its risk plus the squared one of how far its weight is from the expected
  /// one. Makes the risks of all relative to its.
  std::size_t weigh(double expected) {
    std::vector<CandidateReport>& all = report_.candidates;
    const auto loss = [&](const CandidateReport& one) {
      const double distance = std::log(one.weight / expected);
      return std::log(one.expected_error) + distance * distance;
    };
    const auto chosen = std::ranges::min_element(all, {}, loss);
    const double risk = chosen->expected_error;
    for (CandidateReport& one : all) one.expected_error /= risk;
    return static_cast<std::size_t>(chosen - all.begin());
  }

  /// From `start`, or through all stages from the measured positions.
  GraduatedResult solved(double weight, const FlatVectors& start) {
    GraduatedOptions options;
    options.family = kFineFlats;
    options.weight = static_cast<float>(weight);
    options.variance = static_cast<float>(variance_);
    options.across = 1;
    options.fading_area_start = 0.3F;
    options.latent_variance = false;
    options.steps = 10;
    options.metric = &metric_;
    constexpr int kLastStages = 2;
    return solve_({.mesh = mesh_,
                   .measured = mesh_.measured,
                   .options = options,
                   .precisions = {},
                   .latent = {},
                   .final = true,
                   .start = start,
                   .first_stage = start.empty() ? 0 : options.stages - kLastStages});
  }

  /// The products of the slopes of two fields, smoothed, averaged over a patch around each vertex: of the first of the
  /// four, and `factor` times those of the others.
  std::vector<double> products_of_slopes(const FourFields& a, const FourFields& b, double factor) const {
    const FourFields p = walk_.after(a, kSmoothing), q = walk_.after(b, kSmoothing);
    const Eigen::Array4d factors(1, factor, factor, factor);
    std::vector<double> sums(p.size(), 0);
    for (std::size_t e = 0; e < mesh_.edge_count; ++e) {
      const auto i = static_cast<std::size_t>(mesh_.edge_ends[0][e]);
      const auto j = static_cast<std::size_t>(mesh_.edge_ends[1][e]);
      const double product = (factors * (p[i] - p[j]) * (q[i] - q[j])).sum() / 6;
      sums[i] += product;
      sums[j] += product;
    }
    return walk_.after(std::move(sums), kPatch);
  }

  /// Mean root of the expected squared error of slopes, patch by patch.
  double risk_of(const GraduatedResult& result, double weight) {
    constexpr double kLeastRisk = 1e-5;
    const double likelihood = weight / variance_;
    const std::vector<double> diagonal(mesh_.vertex_count, 2 * likelihood);
    metric_.factorize(result.positions, second_derivatives(result.positions), diagonal, kFadedArea);
    FourFields responses = metric_.solve(probes_), probes = probes_;
    const std::vector<float> residuals = products(difference(result.positions, mesh_.measured), result.vertex_normals);
    for (std::size_t v = 0; v < residuals.size(); ++v) {
      responses[v] *= 2 * likelihood;
      probes[v][0] = responses[v][0] = static_cast<double>(residuals[v]);
    }
    const std::vector<double> risks = products_of_slopes(probes, responses, 2.0 / kProbes);
    double sum = 0;
    for (std::size_t v = 0; v < risks.size(); ++v) sum += std::sqrt(std::max(kLeastRisk, risks[v] - noise_[v]));
    return sum / static_cast<double>(risks.size());
  }

  /// Of the square-root potential with respect to the turn of the normals.
  std::vector<float> second_derivatives(const FlatVectors& positions) const {
    const std::vector<float> angles = dihedral_angles(mesh_, positions);
    std::vector<float> result(mesh_.edge_count);
    const float c2 = kFineFlats.scale * kFineFlats.scale;
    for (std::size_t e = 0; e < result.size(); ++e) {
      const auto a = vector_at(positions, static_cast<std::size_t>(mesh_.edge_ends[0][e]));
      const auto b = vector_at(positions, static_cast<std::size_t>(mesh_.edge_ends[1][e]));
      float square = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) square += (a[axis] - b[axis]) * (a[axis] - b[axis]);
      const float chord = 2 * std::sin(angles[e] / 2), q = chord * chord;
      result[e] = std::max(kLeastEdge, std::sqrt(square)) / std::sqrt(q + c2) * c2 / (q + c2);
    }
    return result;
  }

  static constexpr float kFadedArea = 1e-3F;

  const FlatMesh& mesh_;
  const NoiseSpectrum& spectrum_;
  const ChoiceOptions& options_;
  const Solve& solve_;
  ChoiceReport& report_;
  double variance_;  ///< of the noise
  LazyWalk walk_;
  HingeMetric metric_;
  FourFields probes_;          ///< in all but the first
  std::vector<double> noise_;  ///< products of slopes of the noise itself
};

}  // namespace

ChoiceResult remove_correlated_noise(const Surface& surface, const FlatMesh& mesh, const NoiseSpectrum& spectrum,
                                     const ChoiceOptions& options, const Solve& solve, ChoiceReport& report,
                                     ThreadTeam& team) {
  return Scan(surface, mesh, spectrum, options, solve, report, team).run();
}

}  // namespace crease
