#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/base/thread_team.h"
#include "core/geometry/surface.h"

namespace crease {

/// A unit vector as (x, y, z, 0). Single precision is enough, and four numbers are one aligned load.
using UnitNormal = Eigen::Vector4f;

/// Added to the squared length of an area vector before normalisation. It makes the normal of a face without area zero
/// without a branch, and is negligible against the square of any real area in units of ℓ².
inline constexpr float kNoArea = 1e-30F;

/// Geometry of every edge at the present positions and normals. 0 before the first Field::update_edges().
struct EdgeGeometry {
  std::vector<double> chord;    ///< ‖n_i − n_j‖²; 0 for edges that are not interior
  std::vector<double> angle;    ///< signed dihedral angle, radians, + convex; 0 next to a face without area
  std::vector<Vec3> direction;  ///< unit vector from the edge's first vertex to its second, or zero
};

/// The sites and labels of the coupled Markov random field.
struct Field : Surface {
  Field(const Mesh& mesh, const Topology& mesh_topology);

  std::vector<UnitNormal> normals;  ///< per face; zero for a face without area
  std::vector<double> labels;       ///< ε, per edge; 0 for edges that are not interior
  EdgeGeometry edges;

  UnitNormal face_normal(std::size_t face) const;
  void update_normals(ThreadTeam& team);
  /// Recomputes `edges` from positions and normals. Runs without ridge labels need no angles and directions.
  void update_edges(ThreadTeam& team, bool with_angles = true);

 private:
  double signed_angle(std::size_t edge, const Vec3& along) const;
};

}  // namespace crease
