#include "core/choice/scan_path.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/choice/families.h"

namespace crease {
namespace {

constexpr double kLeastScanVariance = 1e-8;
constexpr std::uint32_t kProbes = 3;
constexpr int kSmoothing = 8, kPatch = 64;  ///< steps of the lazy walk
constexpr float kFadedArea = 1e-3F;

constexpr PotentialFamily kFineFlats{.name = kFlatFamily.name, .scale = 0.003F};

}  // namespace

ScanPath::ScanPath(const Surface& surface, const FlatMesh& mesh, const NoiseSpectrum& spectrum, std::uint32_t seed,
                   const Solve& solve, ThreadTeam& team)
    : mesh_(mesh),
      solve_(solve),
      variance_(std::max(kLeastScanVariance, spectrum.sigma() * spectrum.sigma())),
      walk_(surface, team),
      metric_(mesh, team),
      probes_(mesh.vertex_count, Eigen::Array4d::Zero()) {
  for (std::uint32_t k = 0; k < kProbes; ++k) {
    const std::vector<double> probe = spectrum.sample(walk_, mesh.vertex_count, seed + k);
    for (std::size_t v = 0; v < probe.size(); ++v) probes_[v][k + 1] = probe[v];
  }
  noise_ = products_of_slopes(probes_, probes_, 1.0 / kProbes);
}

GraduatedResult ScanPath::solved(double weight, std::span<const float> start) const {
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
std::vector<double> ScanPath::products_of_slopes(const FourFields& a, const FourFields& b, double factor) const {
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

double ScanPath::risk_of(const GraduatedResult& result, double weight) {
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
std::vector<float> ScanPath::second_derivatives(const FlatVectors& positions) const {
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

ScanTrial try_scan(ScanPath& path, const FlatMesh& mesh, const NoiseSpectrum& spectrum) {
  ScanTrial trial;
  std::array<double, kTellingWeights> risks{};
  for (std::size_t k = 0; k < kTellingWeights; ++k) {
    const std::span<const float> start = k > 0 ? std::span<const float>(trial.positions.back()) : std::span<float>();
    GraduatedResult result = path.solved(kScanWeights[k], start);
    risks[k] = path.risk_of(result, kScanWeights[k]);
    trial.positions.push_back(std::move(result.positions));
  }
  trial.features = scan_features(dihedral_angles(mesh, mesh.measured), dihedral_angles(mesh, trial.positions.back()),
                                 risks, spectrum);
  return trial;
}

}  // namespace crease
