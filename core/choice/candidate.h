#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/graduated/descent.h"

namespace crease {

/// ±1 per vertex, at random.
std::vector<float> random_signs(std::size_t count, std::uint32_t seed);

/// A solve, and how well it did without knowing the truth. Residuals are along the normals, divided by the relative
/// deviation of the noise where it varies.
struct Candidate {
  double variance = 0;  ///< of the noise, that it was solved with; in ℓ²
  GraduatedResult result;
  std::vector<float> residuals;  ///< in ℓ

  double residual = 0;    ///< mean of their squares
  double divergence = 0;  ///< mean of ∂result/∂measured

  /// Generalised cross-validation [Craven & Wahba 1978]: needs no variance.
  double cross_validation() const { return residual / ((1 - divergence) * (1 - divergence)); }
  /// Expected squared error of the positions along the normals for noise of this variance, by Stein's unbiased risk
  /// estimate.
  double risk(double noise) const { return residual + 2 * noise * divergence - noise; }
  /// The variance of the noise, if this candidate is right.
  double noise_variance() const;
};

/// The measured positions moved by `step` · signs along the normals, less where the precision is larger.
FlatVectors probed_positions(const FlatMesh& mesh, std::span<const float> normals, std::span<const float> precisions,
                             std::span<const float> signs, float step);

/// Sets `residuals` and `residual` from the result. With `leave_out_border`, vertices at borders do not count.
void score_residuals(Candidate& candidate, const FlatMesh& mesh, std::span<const float> precisions,
                     bool leave_out_border);

/// What a solve answers to probed positions.
struct ProbeView {
  const FlatMesh& mesh;
  std::span<const float> positions;  ///< the result
  std::span<const float> signs;
  std::span<const float> precisions;  ///< relative; empty for 1
  float step = 0;                     ///< in ℓ, for precision 1
  bool leave_out_border = false;
};

/// Sets `divergence`, by a Monte-Carlo probe [Ramani, Blu & Unser 2008].
void score_response(Candidate& candidate, const ProbeView& probe);

}  // namespace crease
