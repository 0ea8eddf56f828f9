#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/base/thread_team.h"
#include "core/geometry/lanes.h"
#include "core/graduated/flat_mesh.h"

namespace crease {

/// w_e and c_e of an edge, below.
struct EdgeTerm {
  float weight = 0, scale = 1;  ///< above 0
};

/// The potentials of eight faces' sides, one in each lane: w/c and 1/c² of each side. Where there is no edge nothing
/// pulls.
struct SideLanes {
  LaneArray<3> stiffness{}, sharpness{1 + Lanes{}, 1 + Lanes{}, 1 + Lanes{}};
};

/// What is noted down of a tile while it is at hand.
struct TileSpace {
  std::vector<LaneRow> points, normals;
  std::vector<float> inverse_lengths;  ///< 1/√(‖N‖² + h²)
};

/// ψ_a(q; c), a robust potential of q = ‖n_i − n_j‖² with exponent a and scale c [Barron 2019]: quadratic at a = 2, the
/// square root of Diebel et al. at a = 1, a logarithm at a = 0. It is the energy of the paper's labels, minimised over
/// them: the line process of [Black & Rangarajan 1996]. Its slope is the label in closed form,
/// 1 − ε = (1 + q/(c²|a − 2|))^(a/2 − 1).
///
/// The energy of positions x, in units of ℓ, while the numbers below stand still:
///
///     E(x) = A Σ_v p_v (t ‖d‖² + (1 − t) (d·m_v)²)         d = x_v − y_v
///          + Σ_e w_e ψ_a(‖n_i − n_j‖²; c_e)                n = N/√(‖N‖² + h²), N the area vector of a face
///          + F Σ_f max(0, τ_f − N_f·r_f)²                  a face that folds over pays for it
///          + ½ Σ_f ‖n_f − t_f‖²                            where targets are given
class GraduatedEnergy {
 public:
  /// The mesh and `data` must outlive the object.
  GraduatedEnergy(const FlatMesh& mesh, std::span<const float> data);

  std::span<const float> measured;  ///< y
  float exponent = 1;               ///< a, −2 to 2, a multiple of a quarter
  float fading_area = 1e-3F;        ///< h: where a face's normal fades to zero; twice an area in ℓ²
  float likelihood = 1;             ///< A
  float across = 1;                 ///< t: cost of moving within the surface, relative to along its normal
  float fold_weight = 3;            ///< F

  std::vector<float> precisions;             ///< p_v
  FlatVectors vertex_normals;                ///< m_v, unit
  std::vector<LaneVectors> face_references;  ///< r_f, unit, in blocks of eight; see set_vector
  std::vector<float> least_areas;            ///< τ_f; 0 beyond the last face
  std::vector<LaneVectors> face_targets;     ///< t_f, unit, or zero for a face without; empty for none at all

  /// Without it, edges weigh nothing.
  void set_edges(ThreadTeam& team, const std::function<EdgeTerm(std::size_t edge)>& term_of);

  /// What the last evaluation was made of.
  struct Parts {
    double likelihood = 0, smoothness = 0, folds = 0;  ///< targets are among the folds
    double total() const { return likelihood + smoothness + folds; }
  };

  /// E at `positions` with its gradient. The same bits for any number of threads.
  double operator()(std::span<const float> positions, std::span<float> gradient, ThreadTeam& team);

  const Parts& parts() const { return parts_; }
  /// ∂ψ/∂q · 2w per edge at `positions`.
  std::vector<float> stiffness(std::span<const float> positions) const;
  float edge_scale(std::size_t edge) const { return edges_[edge].scale; }
  /// One over the second derivative of E along each vertex's normal at the last positions, which are `positions`, for
  /// each of its coordinates; the curvature of ψ itself and the fold term are left out.
  std::vector<float> inverse_curvatures(std::span<const float> positions, ThreadTeam& team) const;

 private:
  const FlatMesh& mesh_;
  std::vector<EdgeTerm> edges_;    ///< one more than there are edges; the last weighs nothing
  std::vector<SideLanes> sides_;   ///< the same, as faces read it
  std::vector<float> curvatures_;  ///< per face: what its normal resists, over its squared length
  std::vector<LaneRow> sums_;      ///< ∂E/∂x of the terms of faces, per sum of the mesh's tiles
  std::vector<TileSpace> spaces_;  ///< per thread
  Parts parts_;
};

}  // namespace crease
