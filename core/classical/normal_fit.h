#pragma once

#include <vector>

#include "core/classical/surface.h"

namespace crease {

/// Moves vertices until the faces look along given normals, in the least-squares sense [Taubin 2001, Shen & Barner
/// 2004]: steps down the gradient of Σ (n_f · (v_i − v_j))² over the sides of all faces, each as long as is safe
/// [Sun et al. 2007].
class NormalFit {
 public:
  explicit NormalFit(Surface& surface) : surface_(surface), next_(surface.positions) {}
  void run(const std::vector<Vec3>& normals, std::uint32_t steps);

 private:
  Surface& surface_;
  std::vector<Vec3> centroids_, next_;
};

}  // namespace crease
