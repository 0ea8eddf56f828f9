#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/graduated/cholesky.h"
#include "core/graduated/flat_mesh.h"

namespace crease {

/// The quadratic form that touches the energy at some positions, one for x, y and z alike:
///
///     H = Σ_e stiffness_e · s_e s_eᵀ + diag
///
/// s_e is the hinge stencil: how far the normals of the edge's faces turn as its four vertices move along them. With a
/// factorisation of H the low frequencies of a surface move as fast as the high ones.
class HingeMetric {
 public:
  /// The mesh and the team must outlive the object.
  HingeMetric(const FlatMesh& mesh, ThreadTeam& team);

  /// `stiffness` per edge, `diagonal` per vertex, `fading_area` as in GraduatedEnergy.
  void factorize(std::span<const float> positions, std::span<const float> stiffness, std::span<const double> diagonal,
                 float fading_area);

  /// H⁻¹ times flat vectors, in place.
  void solve(std::span<float> vectors) const;

 private:
  std::array<double, 4> stencil(std::span<const float> positions, std::size_t edge, float fading_area) const;

  const FlatMesh& mesh_;
  ThreadTeam& team_;
  std::vector<std::array<Index, 10>> places_;  ///< per edge: of the pairs of its vertices in the matrix
  std::vector<Index> diagonal_places_;
  LowerTriangle matrix_;  ///< lower triangle
  SparseCholesky factors_;
};

}  // namespace crease
