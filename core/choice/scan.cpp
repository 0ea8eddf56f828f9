#include "core/choice/scan.h"

#include <algorithm>
#include <cmath>

#include "core/choice/families.h"
#include "core/choice/patches.h"
#include "core/choice/ranking.h"
#include "core/choice/scan_trial.h"

namespace crease {
namespace {

ScanFeatures look_at_scan(const Surface& surface, const FlatMesh& mesh, std::span<const float> precisions,
                          const NoiseSpectrum& spectrum, const Solve& solve, ThreadTeam& team) {
  const auto patches = cut_for_trials(surface, precisions);
  const FlatMesh& tried = patches ? patches->mesh : mesh;
  return try_scan(ScanSolver(tried, patches ? patches->precisions : precisions, spectrum, solve, team), tried,
                  spectrum);
}

/// The variance of the noise as it was estimated, over that which the user gives.
double relative_variance(const NoiseSpectrum& spectrum, const ChoiceOptions& options) {
  constexpr double kLeastSigma = 1e-4;
  return options.noise_sigma ? std::pow(spectrum.sigma() / std::max(kLeastSigma, *options.noise_sigma), 2) : 1;
}

}  // namespace

std::optional<ChoiceResult> remove_correlated_noise(const Surface& surface, const FlatMesh& mesh,
                                                    std::span<const float> precisions, const NoiseSpectrum& spectrum,
                                                    const ChoiceOptions& options, const Solve& solve,
                                                    ChoiceReport& report, ThreadTeam& team) {
  const ScanFeatures features = look_at_scan(surface, mesh, precisions, spectrum, solve, team);
  ScanErrors errors = kFittedScanModel.expected(features);
  const std::span settings(errors.begin(), kScanSettings.size());
  restrict_to_surface(options.surface, kScanSettings, settings);
  if (!options.correlated && !counts_as_scan(kFittedScanModel, features)) return std::nullopt;
  const ScanSolver solver(mesh, precisions, spectrum, solve, team);
  const double relative = relative_variance(spectrum, options);
  report.noise_sigma = options.noise_sigma.value_or(spectrum.sigma());
  report.correlation_length = spectrum.length();
  report_ranking(kScanSettings, settings, relative * solver.variance(), report);
  const Setting chosen = kScanSettings[best_of(settings)];
  Setting final = chosen;
  final.weight *= relative / (options.strength * options.strength);
  return ChoiceResult{
      .setting = chosen, .positions = solver.solved(final, true).positions, .reference_positions = {}, .risk = {}};
}

}  // namespace crease
