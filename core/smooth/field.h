#pragma once

#include <cmath>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"
#include "core/smooth/lanes.h"
#include "core/smooth/options.h"
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

  /// The model at the end of the annealing.
  static EnergyModel final_of(const SmoothOptions& options);
};

/// Added to the squared length of a normal before its root, so that a face without area gets the normal zero without a
/// branch. Far below the square of any area in units of the mean edge length.
inline constexpr float kNoArea = 1e-30F;

/// (x, y, z, 0): single precision suffices for a unit vector, and four of them are one aligned load.
using UnitNormal = Eigen::Vector4f;

/// ρ of two normals that differ by `squared_difference` = ‖n_i − n_j‖² (§3.2).
template <typename Number>
CREASE_LANES_INLINE Number smoothness_potential(Smoothness smoothness, const Number& squared_difference) {
  using crease::sqrt;
  using std::sqrt;
  return smoothness == Smoothness::kQuadratic ? squared_difference : sqrt(squared_difference);
}

/// The sites and labels of the coupled Markov random field, in units of the mean edge length of the measured mesh and
/// relative to its first vertex that has a face. Faces are wound as the topology turns them.
struct Field {
  Field(const Mesh& mesh, const Topology& mesh_topology);

  const Topology& topology;
  double unit = 1;  ///< mean edge length of the measured mesh
  Vec3 origin = Vec3::Zero();
  std::vector<Triangle> faces;
  std::vector<Vec3> measured;       ///< v⁰
  std::vector<Vec3> positions;      ///< v
  std::vector<UnitNormal> normals;  ///< per face; zero for a face without area
  std::vector<double> labels;       ///< ε, per edge; 0 where the edge is not interior

  UnitNormal face_normal(std::size_t face) const;
  void update_normals(ThreadTeam& team);
  /// Positions in the units of the upload; vertices that did not move come back exactly.
  std::vector<Vec3> upload_positions(const Mesh& mesh) const;
};

/// What E needs to know of every edge and vertex, for the present positions, normals and labels.
struct EdgeTerms {
  std::vector<double> potential;  ///< ρ(n_i − n_j), 0 where the edge is not interior
  std::vector<double> angle;      ///< unsigned dihedral angle φ in radians; 0 at faces without area
  std::vector<Vec3> direction;    ///< unit vector from the edge's first vertex to its second; zero without length
  /// Per vertex Σ ε_e u_e over its edges, u_e pointing away from it. The support of edge e at that vertex by all the
  /// others is −u_e · (sum − ε_e u_e): cos θ of a walk through the vertex is minus the cosine between outward
  /// directions.
  std::vector<Vec3> label_sum;

  void update(const Field& field, Smoothness smoothness, ThreadTeam& team);
};

/// E(v, ε) term by term (§3.4). The same value for any number of threads.
Energy energy(const Field& field, const EdgeTerms& terms, const EnergyModel& model, ThreadTeam& team);
Energy energy(const Field& field, const EnergyModel& model);

}  // namespace crease
