#include "core/choice/scan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/choice/families.h"
#include "core/choice/patches.h"
#include "core/choice/scan_trial.h"

namespace crease {
namespace {

constexpr std::size_t kMostFaces = 24'000;  ///< beyond, the telling settings are tried on patches
constexpr std::size_t kPatchFaces = 12'000;

ScanFeatures look_at_scan(const Surface& surface, const FlatMesh& mesh, std::span<const float> precisions,
                          const NoiseSpectrum& spectrum, const Solve& solve, ThreadTeam& team) {
  if (mesh.face_count <= kMostFaces) {
    return try_scan(ScanSolver(mesh, precisions, spectrum, solve, team), mesh, spectrum);
  }
  const Patches patches = cut_patches(surface, kPatchFaces);
  const Topology topology = build_topology(patches.mesh);
  const FlatMesh patch(topology, patches.mesh.triangles, patches.mesh.positions);
  std::vector<float> of_patch;
  for (std::size_t v = 0; v < patches.vertices.size() && !precisions.empty(); ++v) {
    of_patch.push_back(precisions[patches.vertices[v]]);
  }
  return try_scan(ScanSolver(patch, of_patch, spectrum, solve, team), patch, spectrum);
}

/// Only those for the surface that the user names.
ScanErrors restricted(ScanErrors errors, const std::optional<std::string_view>& surface) {
  for (std::size_t k = 0; k < kScanSettings.size() && surface; ++k) {
    if (kScanSettings[k].family.name != *surface) errors[k] = std::numeric_limits<double>::infinity();
  }
  return errors;
}

/// The square of how much weaker the noise is than the user says.
double relative_variance(const NoiseSpectrum& spectrum, const ChoiceOptions& options) {
  constexpr double kLeastSigma = 1e-4;
  return options.noise_sigma ? std::pow(spectrum.sigma() / std::max(kLeastSigma, *options.noise_sigma), 2) : 1;
}

/// With weights in units of one over `variance`.
void report_choice(const ScanErrors& errors, std::size_t chosen, double variance, ChoiceReport& report) {
  report.family = kScanSettings[chosen].family.name;
  report.weight = kScanSettings[chosen].weight * variance;
  double other = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < kScanSettings.size(); ++k) {
    const Setting& setting = kScanSettings[k];
    if (!std::isfinite(errors[k])) continue;
    const double ratio = std::exp(errors[k] - errors[chosen]);
    report.candidates.push_back({std::string(setting.family.name), setting.weight * variance, ratio});
    if (setting.family.name != report.family) other = std::min(other, ratio);
  }
  std::ranges::stable_sort(report.candidates, {}, &CandidateReport::expected_error);
  report.margin = std::isfinite(other) ? other - 1 : 0;
}

}  // namespace

std::optional<ChoiceResult> remove_correlated_noise(const Surface& surface, const FlatMesh& mesh,
                                                    std::span<const float> precisions, const NoiseSpectrum& spectrum,
                                                    const ChoiceOptions& options, const Solve& solve,
                                                    ChoiceReport& report, ThreadTeam& team) {
  const ScanFeatures features = look_at_scan(surface, mesh, precisions, spectrum, solve, team);
  const ScanErrors errors = restricted(kFittedScanModel.expected(features), options.surface);
  const double familiarity = kFittedScanModel.familiarity(features);
  if (!options.correlated && !counts_as_scan(errors, familiarity, spectrum.capture)) return std::nullopt;
  const std::size_t chosen = best_of_scan(errors);
  const ScanSolver solver(mesh, precisions, spectrum, solve, team);
  const double relative = relative_variance(spectrum, options);
  report.noise_sigma = options.noise_sigma.value_or(spectrum.sigma());
  report.correlation_length = spectrum.length();
  report_choice(errors, chosen, relative * solver.variance(), report);
  Setting final = kScanSettings[chosen];
  final.weight *= relative / (options.strength * options.strength);
  ChoiceResult result;
  result.positions = solver.solved(final, true).positions;
  result.ridge_angles = dihedral_angles(mesh, result.positions);
  return result;
}

}  // namespace crease
