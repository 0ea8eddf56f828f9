#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/graduated/descent.h"

namespace crease {

/// ±1 per vertex, at random.
std::vector<float> random_signs(std::size_t count, std::uint32_t seed);

/// A potential with a weight, solved, and how well it did without knowing the truth. Residuals r and the responses d of
/// the result to a change of the measured positions are along the normals, divided by the relative deviation of the
/// noise where it varies.
struct Candidate {
  PotentialFamily family;
  double weight = 0;
  double variance = 0;  ///< that it was solved with
  GraduatedResult result;
  std::vector<float> residuals, responses;
  bool hopeless = false;  ///< its residuals alone rule it out; it has no responses

  double residual = 0;                                            ///< mean r²
  double divergence = 0;                                          ///< mean of ∂result/∂measured
  double ring_residual = 0, ring_divergence = 0, ring_noise = 0;  ///< the same of means over one-rings, and σ² of those
  double deviance = 0;  ///< −2 log-likelihood under a mixture of two Gaussians, plus twice the divergence

  /// Expected squared error of the positions, and of their means over one-rings, by Stein's unbiased risk estimate with
  /// Monte-Carlo probes [Ramani, Blu & Unser 2008], for noise of variance `s`.
  double risk(double s) const {
    constexpr double kRingShare = 0.3;
    return residual + 2 * s * divergence - s + kRingShare * (ring_residual + 2 * s * ring_divergence - s * ring_noise);
  }
  /// Generalised cross-validation: needs no variance.
  double cross_validation() const { return residual / ((1 - divergence) * (1 - divergence)); }
  /// The variance of the noise, if this candidate is right.
  double noise_variance() const;

  bool is(const PotentialFamily& other) const { return family.name == other.name; }
  bool has_setting_of(const Candidate& other) const { return is(other.family) && weight == other.weight; }
};

/// Fills in what is known of a candidate after the response of its result: `probe` is the result for positions moved by
/// `step` · signs along the normals. With `leave_out_border`, vertices at borders do not count.
struct ProbeView {
  const FlatMesh& mesh;
  std::span<const float> measured;
  std::span<const float> probe;  ///< positions
  std::span<const float> signs;
  std::span<const float> precisions;  ///< relative; empty for 1
  float step = 0;                     ///< in ℓ, for precision 1
  bool leave_out_border = false;
};

/// The measured positions moved by `step` · signs along the normals, less where the precision is larger.
FlatVectors probed_positions(const FlatMesh& mesh, std::span<const float> normals, std::span<const float> precisions,
                             std::span<const float> signs, float step);

/// Sets `residuals` and `residual` from the result.
void score_residuals(Candidate& candidate, const FlatMesh& mesh, std::span<const float> measured,
                     std::span<const float> precisions, bool leave_out_border);

/// Sets the rest from a probe.
void score_responses(Candidate& candidate, const ProbeView& view);

/// The risk of a candidate vertex by vertex, in units of the noise variance `s`, averaged over about 600 vertices.
std::vector<float> local_risk(const Candidate& candidate, const FlatMesh& mesh, std::span<const float> signs, double s);

}  // namespace crease
