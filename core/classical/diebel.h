#pragma once

#include <vector>

#include "core/classical/surface.h"

namespace crease {

/// Negative log posterior of Diebel et al. 2006: α Σ_v ‖v⁰ − v‖² + Σ_e ‖n_i − n_j‖ over interior edges, in units of the
/// mean edge length. Norms and normals are rounded off near zero so that it is differentiable everywhere.
class DiebelEnergy {
 public:
  DiebelEnergy(const Surface& surface, double likelihood_weight);

  double value(const std::vector<Vec3>& positions);
  /// The value, and its gradient with respect to the movable vertices; zero at the others.
  double value(const std::vector<Vec3>& positions, std::vector<Vec3>& gradient);

 private:
  void update_normals(const std::vector<Vec3>& positions);
  double likelihood(const std::vector<Vec3>& positions) const;
  void add_prior_gradient(const std::vector<Vec3>& positions, std::vector<Vec3>& gradient) const;

  const Surface& surface_;
  double likelihood_weight_;
  std::vector<Vec3> normals_, normal_gradient_;
  std::vector<double> double_areas_;
};

}  // namespace crease
