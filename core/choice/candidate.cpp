#include "core/choice/candidate.h"

#include <algorithm>
#include <cmath>

#include "core/base/random.h"

namespace crease {
namespace {

constexpr float kLargestResponse = 1.5F, kLargestRingResponse = 1;
constexpr double kRingSize = 7;  ///< of a vertex and its neighbours
constexpr double kLeastLatentVariance = 5e-4;
constexpr int kLocalRounds = 100;

/// Sum over each vertex and its neighbours.
std::vector<float> ring_sums(const FlatMesh& mesh, std::span<const float> values) {
  std::vector<float> sums(values.begin(), values.end());
  for (std::size_t v = 0; v < sums.size(); ++v) {
    for (const Index other : mesh.vertex_neighbors[v]) sums[v] += values[other];
  }
  return sums;
}

float ring_share(const FlatMesh& mesh, std::size_t v) {
  return 1 / static_cast<float>(mesh.vertex_neighbors[v].size() + 1);
}

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

void score_residuals(Candidate& candidate, const FlatMesh& mesh, std::span<const float> measured,
                     std::span<const float> precisions, bool leave_out_border) {
  candidate.residuals = products(difference(candidate.result.positions, measured), candidate.result.vertex_normals);
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

void score_responses(Candidate& candidate, const ProbeView& view) {
  const FlatMesh& mesh = view.mesh;
  candidate.responses = products(difference(view.probe, candidate.result.positions), candidate.result.vertex_normals);
  for (std::size_t v = 0; v < candidate.responses.size(); ++v) {
    candidate.responses[v] *= (view.precisions.empty() ? 1 : std::sqrt(view.precisions[v])) / view.step;
  }
  const std::vector<float> r = ring_sums(mesh, candidate.residuals), d = ring_sums(mesh, candidate.responses),
                           b = ring_sums(mesh, view.signs);
  const std::vector<std::uint8_t> counts = counted(mesh, view.leave_out_border);
  double count = 0, divergence = 0, plain_divergence = 0, ring_residual = 0, ring_divergence = 0, ring_noise = 0;
  for (std::size_t v = 0; v < counts.size(); ++v) {
    if (counts[v] == 0) continue;
    ++count;
    const float variance = relative_variance(candidate, v), share = ring_share(mesh, v);
    const float response = std::clamp(view.signs[v] * candidate.responses[v], -kLargestResponse, kLargestResponse);
    divergence += static_cast<double>(variance * response);
    plain_divergence += static_cast<double>(response);
    ring_residual += static_cast<double>(r[v] * share * r[v] * share);
    ring_divergence += static_cast<double>(
        variance * std::clamp(b[v] * d[v] * share * share, -kLargestRingResponse, kLargestRingResponse));
    ring_noise += static_cast<double>(share);
  }
  candidate.divergence = divergence / count;
  candidate.ring_residual = kRingSize * ring_residual / count;
  candidate.ring_divergence = kRingSize * ring_divergence / count;
  candidate.ring_noise = kRingSize * ring_noise / count;
  candidate.deviance = mixture_deviance(candidate.residuals, kLeastLatentVariance * candidate.variance + 1e-12) +
                       2 * plain_divergence / count;
}

std::vector<float> local_risk(const Candidate& candidate, const FlatMesh& mesh, std::span<const float> signs,
                              double s) {
  constexpr float kLargestResidual = 9, kLargestRingResidual = 3, kRingShare = 2.1F;  // 0.3 · kRingSize
  const std::vector<float> r = ring_sums(mesh, candidate.residuals), d = ring_sums(mesh, candidate.responses),
                           b = ring_sums(mesh, signs);
  const auto variance = static_cast<float>(s);
  std::vector<float> risk(mesh.vertex_count);
  for (std::size_t v = 0; v < risk.size(); ++v) {
    const float share = ring_share(mesh, v), ring = r[v] * share, own = relative_variance(candidate, v);
    const float residual = candidate.residuals[v] * candidate.residuals[v] / variance;
    risk[v] =
        std::min(residual, kLargestResidual) +
        2 * own * std::clamp(signs[v] * candidate.responses[v], -kLargestResponse, kLargestResponse) +
        kRingShare * (std::min(ring * ring / variance, kLargestRingResidual) +
                      2 * own * std::clamp(b[v] * d[v] * share * share, -kLargestRingResponse, kLargestRingResponse));
  }
  mesh.diffuse(risk, kLocalRounds);
  return risk;
}

}  // namespace crease
