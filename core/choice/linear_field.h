#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/base/thread_team.h"
#include "core/geometry/lanes.h"
#include "core/graduated/descent.h"

namespace crease {

/// Eight numbers for a vertex or an edge, one for each of eight fields that are solved for at once.
struct alignas(32) Samples {
  static constexpr std::size_t kCount = 8;
  Lanes lanes{};
};

/// The energy near the end of a descent, as a quadratic form of displacements u along the vertex normals, in units of
/// the likelihood: uᵀ M u with
///
///     M = P + Σ_e t_e t_eᵀ
///
/// P has the precisions of the likelihood; t_e says how far a hinge of two faces turns when its four vertices move,
/// times the root of the potential's curvature over that of the likelihood. M⁻¹ is the covariance of the positions
/// along the normals, in noise variances, given what was measured (Laplace's approximation), and M⁻¹ P the response of
/// the result to the measured positions.
class LinearField {
 public:
  /// `positions` are where a descent with these options and precisions ended. The mesh and the team must outlive the
  /// object.
  LinearField(const FlatMesh& mesh, const FlatVectors& positions, const GraduatedOptions& options,
              std::span<const float> precisions, ThreadTeam& team);

  /// Draws from the normal distribution with covariance M⁻¹ up to its first two moments, by perturbing what M is the
  /// sum of and solving [Papandreou & Yuille 2010]. `number` counts draws of eight. `on_step` is called on this thread
  /// between steps and may throw to end the solve.
  std::vector<Samples> draw(std::uint32_t seed, std::uint32_t number, const std::function<void()>& on_step);

  /// Draws with covariance (M⁻¹ P)^steps P⁻¹, for a diffusion of so many steps: white noise that half of the steps have
  /// smoothed. With one step it would be the M⁻¹ of `draw`.
  std::vector<Samples> draw_diffused(std::uint32_t seed, std::uint32_t number, int steps,
                                     const std::function<void()>& on_step);

  /// M⁻¹ · P · values.
  std::vector<Samples> response(const std::vector<Samples>& values, const std::function<void()>& on_step);

  const std::vector<float>& precisions() const { return precisions_; }  ///< above 0
  const std::vector<float>& diagonal() const { return diagonal_; }      ///< of M
  const FlatVectors& normals() const { return normals_; }

 private:
  using Hinge = std::array<FlatIndex, 4>;
  using Stencil = std::array<float, 4>;

  void linearize(const GraduatedEnergy& energy, std::span<const float> positions);
  Stencil stencil_of(std::span<const float> positions, const Hinge& hinge, float fading_area) const;
  void gather_coefficients();
  void find_turns(const std::vector<Samples>& fields);
  void add_turns(std::vector<Samples>& sums);
  std::vector<Samples> product(const std::vector<Samples>& fields);
  Samples dot(const std::vector<Samples>& a, const std::vector<Samples>& b);
  std::vector<Samples> solve(std::vector<Samples> right, const std::function<void()>& on_step);
  template <typename Body>
  void for_each_vertex(Body body);

  const FlatMesh& mesh_;
  ThreadTeam& team_;
  FlatVectors normals_;
  std::vector<float> precisions_, diagonal_;
  std::vector<Hinge> hinges_;        ///< per edge: opposite, opposite, end, end
  std::vector<Stencil> stencils_;    ///< per edge: t_e at those
  std::vector<float> coefficients_;  ///< t_e at a vertex, for each item of the mesh's vertex_stencils
  std::vector<Samples> turns_;       ///< per edge
};

}  // namespace crease
