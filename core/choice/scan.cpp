#include "core/choice/scan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/choice/families.h"
#include "core/choice/scan_path.h"

namespace crease {
namespace {

void report_scan(const NoiseSpectrum& spectrum, const ScanErrors& errors, std::size_t chosen, ChoiceReport& report) {
  report.noise_sigma = spectrum.sigma();
  report.correlation_length = spectrum.length();
  report.family = kFlatFamily.name;
  report.weight = kScanWeights[chosen];
  for (std::size_t k = 0; k < kScanWeights.size(); ++k) {
    report.candidates.push_back({report.family, kScanWeights[k], std::exp(errors[k] - errors[chosen])});
  }
}

}  // namespace

std::optional<ChoiceResult> remove_correlated_noise(const Surface& surface, const FlatMesh& mesh,
                                                    const NoiseSpectrum& spectrum, const ChoiceOptions& options,
                                                    const Solve& solve, ChoiceReport& report, ThreadTeam& team) {
  ScanPath path(surface, mesh, spectrum, options.seed, solve, team);
  ScanTrial trial = try_scan(path, mesh, spectrum);
  const ScanErrors errors = kFittedScanModel.expected(trial.features);
  const std::span weights(errors.begin(), kScanWeights.size());
  const auto chosen = static_cast<std::size_t>(std::ranges::min_element(weights) - weights.begin());
  if (!options.correlated && errors.back() - errors[chosen] < kLeastGainOfScan) return std::nullopt;
  report_scan(spectrum, errors, chosen, report);
  FlatVectors best = std::move(trial.positions[std::min(chosen, kTellingWeights - 1)]);
  for (std::size_t k = kTellingWeights; k <= chosen; ++k) best = path.solved(kScanWeights[k], best).positions;
  if (options.strength != 1) {
    best = path.solved(report.weight / (options.strength * options.strength), best).positions;
  }
  ChoiceResult result;
  result.ridge_angles = dihedral_angles(mesh, best);
  result.positions = std::move(best);
  return result;
}

}  // namespace crease
