#include "core/classical/normal_fit.h"

namespace crease {

void NormalFit::run(const std::vector<Vec3>& normals, std::uint32_t steps) {
  centroids_.resize(normals.size());
  for (std::uint32_t step = 0; step < steps; ++step) {
    for (std::size_t f = 0; f < normals.size(); ++f) centroids_[f] = surface_.centroid(f);
    for (const Index v : surface_.movable) {
      const Vec3& here = surface_.positions[v];
      const auto faces = surface_.topology.vertex_faces[v];
      Vec3 sum = Vec3::Zero();
      for (const Index f : faces) sum += normals[f].dot(centroids_[f] - here) * normals[f];
      next_[v] = here + sum / static_cast<double>(faces.size());
    }
    surface_.positions.swap(next_);
  }
}

}  // namespace crease
