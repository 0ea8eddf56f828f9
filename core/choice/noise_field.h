#pragma once

#include <span>
#include <vector>

#include "core/graduated/flat_mesh.h"

namespace crease {

/// How the strength of the noise varies over a surface.
struct NoiseField {
  std::vector<float> variances;  ///< per vertex, relative; their geometric mean is 1
  double spread = 0;             ///< variance of their logarithms: 0.01 to 0.02 for uniform noise

  /// 1 / variances.
  std::vector<float> precisions() const;
};

/// From residuals along the normals: their squares, those of outliers cut off, averaged over about 250 vertices.
/// Residuals at borders say nothing and do not count.
NoiseField estimate_noise_field(const FlatMesh& mesh, std::span<const float> residuals);

}  // namespace crease
