#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/base/thread_team.h"
#include "core/geometry/surface.h"

namespace crease {

/// (x, y, z, 0): single precision suffices for a unit vector, and four of them are one aligned load.
using UnitNormal = Eigen::Vector4f;

/// Added to the squared length of a normal before its root, so that a face without area gets the normal zero without a
/// branch. Far below the square of any area in units of the mean edge length.
inline constexpr float kNoArea = 1e-30F;

/// What the terms see of every edge, for the present positions and normals; 0 before they are asked for.
struct EdgeGeometry {
  std::vector<double> chord;    ///< ‖n_i − n_j‖²; 0 where the edge is not interior
  std::vector<double> angle;    ///< signed dihedral angle in radians, + convex; 0 at faces without area
  std::vector<Vec3> direction;  ///< unit vector from the edge's first vertex to its second; zero without length
};

/// The sites and labels of the coupled Markov random field.
struct Field : Surface {
  Field(const Mesh& mesh, const Topology& mesh_topology);

  std::vector<UnitNormal> normals;  ///< per face; zero for a face without area
  std::vector<double> labels;       ///< ε, per edge; 0 where the edge is not interior
  EdgeGeometry edges;

  UnitNormal face_normal(std::size_t face) const;
  void update_normals(ThreadTeam& team);
  /// Makes `edges` anew from positions and normals. Where nothing is labelled, nobody asks for angles and directions.
  void update_edges(ThreadTeam& team, bool with_angles = true);

 private:
  double signed_angle(std::size_t edge, const Vec3& along) const;
};

}  // namespace crease
