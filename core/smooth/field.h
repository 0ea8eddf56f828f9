#pragma once

#include <numbers>
#include <span>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"
#include "core/options/options.h"
#include "core/smooth/likelihood.h"
#include "core/smooth/second_difference.h"
#include "core/smooth/smooth.h"
#include "core/smooth/thread_team.h"

namespace crease {

/// Weights of the terms of E(v, ε) and the shape of the smoothness potential at one moment of the annealing.
struct EnergyModel {
  double likelihood_weight = 0;    ///< α, per squared mean edge length
  double smoothness_weight = 0;    ///< β
  double sharpness_weight = 0;     ///< γ, per radian
  double sharpness_threshold = 0;  ///< φ₀, radians
  double support_weight = 0;       ///< κ, relative to γ
  Smoothness smoothness = Smoothness::kQuadratic;
  float smoothness_width = 0;    ///< δ, as a difference of unit normals
  double curvature_weight = 0;   ///< of the piecewise-quadratic prior
  double continuity_weight = 0;  ///< of the change of dihedral angle along a ridge, per squared radian
  double ridge_line_weight = 0;  ///< of the second difference along a ridge, per squared mean edge length
  RidgeKind ridge_kind = RidgeKind::kAll;
  double sharpness_limit = std::numbers::pi;  ///< radians; sharper edges are no ridges

  /// The model at the end of the annealing.
  static EnergyModel final_of(const MrfOptions& options);
};

/// Added to the squared length of a normal before its root, so that a face without area gets the normal zero without a
/// branch. Far below the square of any area in units of the mean edge length.
inline constexpr float kNoArea = 1e-30F;

/// The sites and labels of the coupled Markov random field, in units of the mean edge length of the measured mesh and
/// relative to its first vertex that has a face. Faces are wound as the topology turns them.
struct Field {
  /// `weights` of the likelihood per vertex, empty for 1 everywhere.
  Field(const Mesh& mesh, const Topology& mesh_topology, const MrfOptions& options = {},
        std::span<const double> weights = {});

  const Topology& topology;
  double unit = 1;  ///< mean edge length of the measured mesh
  Vec3 origin = Vec3::Zero();
  std::vector<Triangle> faces;
  std::vector<Vec3> measured;       ///< v⁰
  std::vector<Vec3> positions;      ///< v
  std::vector<UnitNormal> normals;  ///< per face; zero for a face without area
  std::vector<double> labels;       ///< ε, per edge; 0 where the edge is not interior
  Likelihood likelihood;
  SecondDifference second_difference;

  UnitNormal face_normal(std::size_t face) const;
  void update_normals(ThreadTeam& team);
  /// Positions in the units of the upload; vertices that did not move come back exactly.
  std::vector<Vec3> upload_positions(const Mesh& mesh) const;
};

double Likelihood::change(const Field& field, Index vertex, const Vec3& to) const {
  if (kind_ != LikelihoodKind::kQuadratic) return general_change(field, vertex, to);
  const Vec3& measured = field.measured[vertex];
  return weights_[vertex] * ((to - measured).squaredNorm() - (field.positions[vertex] - measured).squaredNorm());
}

/// What E needs to know of every edge and vertex, for the present positions, normals and labels.
struct EdgeTerms {
  std::vector<double> potential;  ///< ρ(n_i − n_j), 0 where the edge is not interior
  std::vector<double> dihedral;   ///< signed dihedral angle in radians, + convex; 0 at faces without area
  std::vector<double> angle;      ///< φ as the edge process sees it: |dihedral|, negative for what may be no ridge
  std::vector<double> curvature;  ///< squared second difference of the normals per face; empty without its prior
  std::vector<Vec3> direction;    ///< unit vector from the edge's first vertex to its second; zero without length
  /// Per vertex Σ ε_e u_e over its edges, u_e pointing away from it. The support of edge e at that vertex by all the
  /// others is −u_e · (sum − ε_e u_e): cos θ of a walk through the vertex is minus the cosine between outward
  /// directions.
  std::vector<Vec3> label_sum;

  void update(const Field& field, const EnergyModel& model, ThreadTeam& team);
};

/// Σ over the labelled edges e' that go on from `edge`: cos θ (φ − φ')² ε', for θ below a right angle. The derivative
/// by ε of "the dihedral angle changes slowly along a ridge line" (§3.3), without its weight.
double continuity_slope(const Field& field, const EdgeTerms& terms, Index edge);

/// E(v, ε) term by term (§3.4). The same value for any number of threads.
Energy energy(const Field& field, const EdgeTerms& terms, const EnergyModel& model, ThreadTeam& team);
Energy energy(const Field& field, const EnergyModel& model);

}  // namespace crease
