#include <cmath>
#include <span>
#include <vector>

#include "core/smooth/classical/methods.h"
#include "core/smooth/classical/walk.h"

namespace crease {
namespace {

/// Bilateral filter of heights: every vertex moves along its normal by the mean height of the vertices around over its
/// tangent plane, weighted by nearness and by smallness of the height [Fleishman, Drori & Cohen-Or 2003].
class Bilateral {
 public:
  Bilateral(PinnedSurface& surface, double spatial_width, double range_width)
      : surface_(surface),
        spatial_scale_(1 / (2 * spatial_width * spatial_width)),
        range_scale_(1 / (2 * range_width * range_width)),
        squared_radius_(4 * spatial_width * spatial_width),
        walk_(surface.positions.size()),
        area_vectors_(surface.faces.size()),
        next_(surface.positions) {}

  bool operator()() {
    for (std::size_t f = 0; f < area_vectors_.size(); ++f) area_vectors_[f] = surface_.area_vector(f);
    for (const Index v : surface_.movable) next_[v] = filtered(v);
    surface_.positions.swap(next_);
    return true;
  }

 private:
  Vec3 filtered(Index v) {
    const Vec3& here = surface_.positions[v];
    const Vec3 normal = vertex_normal(v);
    double sum = 0, weights = 0;
    for (const Index other : vertices_around(v)) {
      if (other == v) continue;
      const Vec3 away = surface_.positions[other] - here;
      const double height = normal.dot(away);
      const double weight = std::exp(-away.squaredNorm() * spatial_scale_ - height * height * range_scale_);
      sum += weight * height;
      weights += weight;
    }
    return weights > 0 ? Vec3(here + sum / weights * normal) : here;
  }

  /// Weighted by area.
  Vec3 vertex_normal(Index v) const {
    Vec3 sum = Vec3::Zero();
    for (const Index f : surface_.topology.vertex_faces[v]) sum += area_vectors_[f];
    return direction(sum);
  }

  /// The vertices within twice the spatial width that edges lead to, not beyond vertices that stay.
  std::span<const Index> vertices_around(Index v) {
    const Vec3& center = surface_.positions[v];
    return walk_.from(
        {&v, 1},
        [&](Index site, auto visit) {
          if (surface_.is_movable[site] != 0) surface_.visit_vertex_neighbors(site, visit);
        },
        [&](Index site) { return (surface_.positions[site] - center).squaredNorm() < squared_radius_; });
  }

  PinnedSurface& surface_;
  double spatial_scale_, range_scale_, squared_radius_;
  Walk walk_;
  std::vector<Vec3> area_vectors_, next_;
};

}  // namespace

ClassicalStep make_step(PinnedSurface& surface, const BilateralOptions& options) {
  return Bilateral(surface, options.spatial_width, options.range_width);
}

}  // namespace crease
