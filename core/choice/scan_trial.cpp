#include "core/choice/scan_trial.h"

#include <algorithm>
#include <vector>

#include "core/choice/candidate.h"

namespace crease {
namespace {

constexpr double kLeastScanVariance = 1e-8;

}  // namespace

ScanSolver::ScanSolver(const FlatMesh& mesh, std::span<const float> precisions, const NoiseSpectrum& spectrum,
                       const Solve& solve, ThreadTeam& team)
    : mesh_(mesh),
      precisions_(precisions),
      solve_(solve),
      variance_(std::max(kLeastScanVariance, spectrum.sigma() * spectrum.sigma())),
      metric_(mesh, team) {}

GraduatedResult ScanSolver::solved(const Setting& setting, bool final) const {
  GraduatedOptions options;
  options.family = setting.family;
  options.variance = static_cast<float>(variance_);
  options.weight = static_cast<float>(setting.weight * variance_);
  options.across = 1;
  options.fading_area_start = 0.3F;
  options.latent_variance = false;
  options.steps = 6;
  options.metric = &metric_;
  return solve_({mesh_, mesh_.measured, options, precisions_, {}, final});
}

ScanFeatures try_scan(const ScanSolver& solver, const FlatMesh& mesh, const NoiseSpectrum& spectrum) {
  std::vector<ScanLook> looks;
  for (const Setting& setting : kTellingScanSettings) {
    Candidate candidate;
    candidate.result = solver.solved(setting, false);
    score_residuals(candidate, mesh, {}, false);
    looks.push_back({dihedral_angles(mesh, candidate.result.positions), candidate.residual});
  }
  return scan_features(dihedral_angles(mesh, mesh.measured), looks, spectrum);
}

}  // namespace crease
