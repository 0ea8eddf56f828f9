#include "core/smooth/refinement.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/graduated/unmoved.h"
#include "core/options/options.h"
#include "core/regression/label_regression.h"
#include "core/regression/passes.h"

namespace crease {
namespace {

/// How far noise is above what counts as none.
double noisiness(const ChoiceReport& report) {
  constexpr double kNoNoise = 0.005, kLittleNoise = 0.015;  // in ℓ
  return std::clamp((report.noise_sigma - kNoNoise) / (kLittleNoise - kNoNoise), 0.0, 1.0);
}

}  // namespace

Refined refine(const FlatMesh& mesh, const ChoiceResult& chosen, const ChoiceReport& report, double strength,
               std::span<const float> precisions, ThreadTeam& team, const std::function<void()>& on_step) {
  const auto amount = static_cast<float>(std::max(0.0, 1 - std::abs(strength - 1)) * noisiness(report));
  if (!(amount > 0)) return {chosen.positions, {}};
  const std::size_t passes = mesh.face_count <= kFacesOfSeconds ? kPasses : 1;
  auto [positions, normals] =
      turned_in_passes(mesh, chosen.positions, chosen.reference_positions, sight_of(chosen.setting, report), amount,
                       precisions, passes, team, on_step);
  if (report.impulsive && !report.varying && precisions.empty()) {
    positions = with_unmoved_put_back(mesh, positions, mesh.measured, amount, team);
  }
  return {std::move(positions), std::move(normals)};
}

std::vector<float> labels_of(const FlatMesh& mesh, const Refined& refined, const ChoiceResult& chosen,
                             const ChoiceReport& report, ThreadTeam& team) {
  const auto share = static_cast<float>(noisiness(report));
  std::vector<float> labels = labels_of_angles(dihedral_angles(mesh, refined.positions, team), report.noise_sigma);
  if (!(share > 0)) return labels;
  const LabelFeatures features(mesh, refined.positions, chosen.reference_positions, refined.normals,
                               sight_of(chosen.setting, report), team);
  const std::vector<float> regressed = regressed_labels(mesh, features, team);
  for (std::size_t e = 0; e < labels.size(); ++e) labels[e] += share * (regressed[e] - labels[e]);
  return labels;
}

/// A logistic function that is steep where there is little noise. Its constants were fitted to the training pairs of
/// tests/quality.
std::vector<float> labels_of_angles(std::vector<float> angles, double noise_sigma) {
  constexpr double kRidge = 25 * kDegree, kBias = 6 * kDegree, kLittleNoise = 0.08;
  constexpr double kSlope = 0.5 * kDegree, kSlopeOfLittle = 5 * kDegree, kSlopeOfMore = 13.5 * kDegree;
  const double little = std::min(1.0, noise_sigma / kLittleNoise), more = std::max(0.0, noise_sigma - kLittleNoise);
  const double middle = kRidge + kBias * little, slope = kSlope + kSlopeOfLittle * little + kSlopeOfMore * more;
  for (float& angle : angles) {
    angle = static_cast<float>(1 / (1 + std::exp((middle - static_cast<double>(angle)) / slope)));
  }
  return angles;
}

}  // namespace crease
