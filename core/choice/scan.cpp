#include "core/choice/scan.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/choice/families.h"
#include "core/graduated/hinge_metric.h"

namespace crease {
namespace {

constexpr double kFirstWeight = 0.2;  ///< over the finest density
constexpr double kLargestWeight = 1000, kLeastWeight = 0.003, kFactor = 1.6;
constexpr int kPatience = 2;  ///< weights in a row that do worse
constexpr std::uint32_t kProbes = 3;
constexpr int kSmoothing = 8, kPatch = 64;  ///< steps of the lazy walk

/// Flats with a scale far below any facet.
constexpr PotentialFamily kFineFlats{.name = kFlatFamily.name, .scale = 0.003F};

class Scan {
 public:
  Scan(const Surface& surface, const FlatMesh& mesh, const NoiseSpectrum& spectrum, const ChoiceOptions& options,
       const Solve& solve, ChoiceReport& report)
      : mesh_(mesh),
        spectrum_(spectrum),
        options_(options),
        solve_(solve),
        report_(report),
        walk_(surface),
        metric_(mesh) {
    for (std::uint32_t k = 0; k < kProbes; ++k) {
      probes_.push_back(spectrum.sample(walk_, mesh.vertex_count, options.seed + k));
    }
    noise_.assign(mesh.vertex_count, 0);
    for (const auto& probe : probes_) add(noise_, products_of_slopes(probe, probe), 1.0 / kProbes);
  }

  ChoiceResult run() {
    report_.noise_sigma = spectrum_.sigma();
    report_.correlation_length = spectrum_.length();
    report_.family = kFineFlats.name;
    FlatVectors positions, best;
    double lowest = std::numeric_limits<double>::infinity();
    int worse = 0;
    const double first = std::min(kFirstWeight / spectrum_.finest, kLargestWeight);
    for (double weight = first; weight > kLeastWeight && worse < kPatience; weight /= kFactor) {
      const GraduatedResult result = solved(weight, positions);
      positions = result.positions;
      const double risk = risk_of(result, weight);
      report_.candidates.push_back({report_.family, weight, risk});
      worse = risk < lowest ? 0 : worse + 1;
      if (worse > 0) continue;
      lowest = risk;
      report_.weight = weight;
      best = positions;
    }
    if (options_.strength != 1) {
      best = solved(report_.weight / (options_.strength * options_.strength), best).positions;
    }
    for (CandidateReport& one : report_.candidates) one.expected_error /= lowest;
    ChoiceResult chosen;
    chosen.ridge_angles = dihedral_angles(mesh_, best);
    chosen.positions = std::move(best);
    return chosen;
  }

 private:
  /// From `start`, or through all stages from the measured positions.
  GraduatedResult solved(double weight, const FlatVectors& start) {
    GraduatedOptions options;
    options.family = kFineFlats;
    options.weight = static_cast<float>(weight);
    options.variance = 1;
    options.across = 1;
    options.fading_area_start = 0.3F;
    options.latent_variance = false;
    options.steps = 20;
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

  static void add(std::vector<double>& sum, const std::vector<double>& values, double factor) {
    for (std::size_t v = 0; v < sum.size(); ++v) sum[v] += factor * values[v];
  }

  /// The products of the slopes of two fields, smoothed, averaged over a patch around each vertex.
  std::vector<double> products_of_slopes(const std::vector<double>& a, const std::vector<double>& b) const {
    const std::vector<double> p = walk_.after(a, kSmoothing), q = walk_.after(b, kSmoothing);
    std::vector<double> sums(p.size(), 0);
    for (std::size_t e = 0; e < mesh_.edge_count; ++e) {
      const auto i = static_cast<std::size_t>(mesh_.edge_ends[0][e]);
      const auto j = static_cast<std::size_t>(mesh_.edge_ends[1][e]);
      const double product = (p[i] - p[j]) * (q[i] - q[j]) / 6;
      sums[i] += product;
      sums[j] += product;
    }
    return walk_.after(std::move(sums), kPatch);
  }

  /// Mean root of the expected squared error of slopes, patch by patch.
  double risk_of(const GraduatedResult& result, double weight) {
    constexpr double kLeastRisk = 1e-5;
    const std::vector<float> along = products(difference(result.positions, mesh_.measured), result.vertex_normals);
    const std::vector<double> residuals(along.begin(), along.end());
    std::vector<double> risks = products_of_slopes(residuals, residuals);
    const std::vector<double> diagonal(mesh_.vertex_count, 2 * weight);
    metric_.factorize(result.positions, second_derivatives(result.positions), diagonal, kFadedArea);
    for (const auto& probe : probes_) {
      std::vector<double> response = metric_.solve(probe);
      for (double& value : response) value *= 2 * weight;
      add(risks, products_of_slopes(probe, response), 2.0 / kProbes);
    }
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
  LazyWalk walk_;
  HingeMetric metric_;
  std::vector<std::vector<double>> probes_;
  std::vector<double> noise_;  ///< products of slopes of the noise itself
};

}  // namespace

ChoiceResult remove_correlated_noise(const Surface& surface, const FlatMesh& mesh, const NoiseSpectrum& spectrum,
                                     const ChoiceOptions& options, const Solve& solve, ChoiceReport& report) {
  return Scan(surface, mesh, spectrum, options, solve, report).run();
}

}  // namespace crease
