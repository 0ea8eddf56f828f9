#pragma once

#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "core/energy/terms.h"

namespace crease {

/// E and its gradient as functions of all positions, with fixed labels, for descent. Positions and gradients are flat
/// arrays of 3·vertices numbers in units of ℓ: all x, then all y, then all z. Real is float or double.
///
/// Two changes make E differentiable everywhere: the square-root potential is rounded off near zero, and the normal of
/// a face fades to zero with its area.
template <typename Real>
class EnergyGradient {
 public:
  /// Field and terms must outlive the object.
  EnergyGradient(const Field& field, const EnergyTerms& terms);

  /// Writes the gradient at `positions` to `gradient` and returns E. Call EnergyTerms::labels_changed() first. The
  /// result does not depend on the number of threads.
  double operator()(const Weights& weights, std::span<const Real> positions, std::span<Real> gradient,
                    ThreadTeam& team);

 private:
  using Vector = Eigen::Matrix<Real, 3, 1>;

  /// Reads vectors from a flat array.
  struct View {
    using Vector = EnergyGradient::Vector;
    const Real *x, *y, *z;
    Vector operator()(std::size_t i) const { return {x[i], y[i], z[i]}; }
  };
  static View view(std::span<const Real> flat) {
    const std::size_t count = flat.size() / 3;
    return {flat.data(), flat.data() + count, flat.data() + 2 * count};
  }
  void update_normals(View points, ThreadTeam& team);
  double edge_pass(const Weights& weights, ThreadTeam& team);
  double face_pass(const Weights& weights, View points, ThreadTeam& team);
  double vertex_pass(const Weights& weights, View points, std::span<Real> gradient, ThreadTeam& team);
  Vector by_normal(const Weights& weights, std::size_t face) const;

  /// Twice the area in ℓ² below which a normal fades to zero.
  static constexpr Real kFadingArea = Real(1e-3);

  const Field& field_;
  const EnergyTerms& terms_;
  std::vector<std::array<Index, 3>> neighbors_;  ///< per face, the faces across its edges; itself if there is none
  std::vector<std::array<Index, 3>> edges_;      ///< per face; one past the last edge if there is none
  IndexRows corners_;                            ///< per vertex; corner k of face f has the number k · faces + f
  std::vector<Real> normals_;                    ///< faded; flat
  std::vector<Real> inverse_lengths_;            ///< of the area vectors, per face
  std::vector<Real> stiffness_;                  ///< per edge: 2 · ∂E/∂‖n_i − n_j‖²
  std::vector<Real> by_corner_;                  ///< per corner, ∂E/∂(position of the corner); flat
};

extern template class EnergyGradient<float>;
extern template class EnergyGradient<double>;

}  // namespace crease
