#include "core/choice/candidate.h"

#include <algorithm>
#include <cmath>

#include "core/base/random.h"

namespace crease {
namespace {

constexpr float kLargestResponse = 1.5F;

/// Which vertices the scores count: all of them where too few would be left.
std::vector<std::uint8_t> counted(const FlatMesh& mesh, bool leave_out_border) {
  std::vector<std::uint8_t> result(mesh.vertex_count, 1);
  if (!leave_out_border) return result;
  const auto inner = static_cast<std::size_t>(std::ranges::count(mesh.at_border, std::uint8_t{0}));
  if (inner <= mesh.vertex_count / 2) return result;
  for (std::size_t v = 0; v < result.size(); ++v) result[v] = mesh.at_border[v] == 0 ? 1 : 0;
  return result;
}

float relative_variance(const Candidate& candidate, std::size_t v) {
  const std::vector<float>& variances = candidate.result.latent.relative_variance;
  return variances.empty() ? 1 : variances[v];
}

}  // namespace

double Candidate::noise_variance() const {
  constexpr double kLeastVariance = 1e-8, kLeastFreedom = 0.05;
  return std::max(kLeastVariance, residual / std::max(kLeastFreedom, 1 - divergence));
}

std::vector<float> random_signs(std::size_t count, std::uint32_t seed) {
  const CounterRandom random(seed, RandomStream::kProbe);
  std::vector<float> signs(count);
  for (std::size_t v = 0; v < count; ++v) signs[v] = (random(0, static_cast<std::uint32_t>(v))[0] >> 31) != 0 ? 1 : -1;
  return signs;
}

FlatVectors probed_positions(const FlatMesh& mesh, std::span<const float> normals, std::span<const float> precisions,
                             std::span<const float> signs, float step) {
  FlatVectors probed = mesh.measured;
  const std::size_t count = mesh.vertex_count;
  for (std::size_t v = 0; v < count; ++v) {
    const float precision = precisions.empty() ? 1 : precisions[v];
    const float move = precision > 0 ? step * signs[v] / std::sqrt(precision) : 0;
    for (std::size_t axis = 0; axis < 3; ++axis) probed[axis * count + v] += move * normals[axis * count + v];
  }
  return probed;
}

void score_residuals(Candidate& candidate, const FlatMesh& mesh, std::span<const float> precisions,
                     bool leave_out_border) {
  candidate.residuals =
      products(difference(candidate.result.positions, mesh.measured), candidate.result.vertex_normals);
  for (std::size_t v = 0; v < precisions.size(); ++v) candidate.residuals[v] *= std::sqrt(precisions[v]);
  const std::vector<std::uint8_t> counts = counted(mesh, leave_out_border);
  double sum = 0, count = 0;
  for (std::size_t v = 0; v < counts.size(); ++v) {
    if (counts[v] == 0) continue;
    sum += static_cast<double>(candidate.residuals[v] * candidate.residuals[v]);
    ++count;
  }
  candidate.residual = sum / count;
}

void score_response(Candidate& candidate, const ProbeView& probe) {
  const std::vector<float> responses =
      products(difference(probe.positions, candidate.result.positions), candidate.result.vertex_normals);
  const std::vector<std::uint8_t> counts = counted(probe.mesh, probe.leave_out_border);
  double sum = 0, count = 0;
  for (std::size_t v = 0; v < counts.size(); ++v) {
    if (counts[v] == 0) continue;
    const float scale = (probe.precisions.empty() ? 1 : std::sqrt(probe.precisions[v])) / probe.step;
    const float response = std::clamp(probe.signs[v] * responses[v] * scale, -kLargestResponse, kLargestResponse);
    sum += static_cast<double>(relative_variance(candidate, v) * response);
    ++count;
  }
  candidate.divergence = sum / count;
}

}  // namespace crease
