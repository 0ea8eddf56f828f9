#include <cmath>
#include <span>
#include <vector>

#include "core/smooth/classical/methods.h"
#include "core/smooth/classical/walk.h"

namespace crease {
namespace {

double gaussian(double squared_distance, double width) { return std::exp(-squared_distance / (2 * width * width)); }

/// One pass: every vertex becomes the mean of its projections onto the planes of the faces around, weighted by area,
/// by nearness and by how little a plane contradicts the vertex. The planes' normals are those of the surface
/// mollified at half the spatial width [Jones, Durand & Desbrun 2003].
class NonIterative {
 public:
  NonIterative(PinnedSurface& surface, double spatial_width, double range_width)
      : surface_(surface), spatial_width_(spatial_width), range_width_(range_width), walk_(surface.faces.size()) {}

  bool operator()() {
    measure_faces();
    std::vector<Vec3> original = surface_.positions;
    move_all(original, spatial_width_ / 2, [&](Index f, const Vec3&) { return Prediction{centroids_[f], 1}; });
    surface_.normals_of_faces(normals_);
    move_all(original, spatial_width_, [&](Index f, const Vec3& p) {
      const double height = normals_[f].dot(centroids_[f] - p);
      return Prediction{p + height * normals_[f], gaussian(height * height, range_width_)};
    });
    return false;
  }

 private:
  struct Prediction {
    Vec3 position;
    double weight;
  };

  void measure_faces() {
    const std::size_t count = surface_.faces.size();
    areas_.resize(count);
    centroids_.resize(count);
    for (std::size_t f = 0; f < count; ++f) {
      areas_[f] = surface_.area_vector(f).norm();
      centroids_[f] = surface_.centroid(f);
    }
  }

  /// Moves each vertex from where it is in `original` to the weighted mean of what the faces around predict for it.
  template <typename Predict>
  void move_all(const std::vector<Vec3>& original, double width, Predict predict) {
    for (const Index v : surface_.movable) {
      const Vec3& here = original[v];
      Vec3 sum = Vec3::Zero();
      double weights = 0;
      for (const Index f : faces_around(v, here, 2 * width)) {
        const Prediction prediction = predict(f, here);
        const double weight = areas_[f] * gaussian((centroids_[f] - here).squaredNorm(), width) * prediction.weight;
        sum += weight * (prediction.position - here);
        weights += weight;
      }
      surface_.positions[v] = weights > 0 ? Vec3(here + sum / weights) : here;
    }
  }

  /// The faces at the vertex, and those with a centroid within `radius` that interior edges lead to.
  std::span<const Index> faces_around(Index v, const Vec3& center, double radius) {
    return walk_.from(
        surface_.topology.vertex_faces[v], [&](Index f, auto visit) { surface_.visit_face_neighbors(f, visit); },
        [&](Index f) { return (centroids_[f] - center).squaredNorm() < radius * radius; });
  }

  PinnedSurface& surface_;
  double spatial_width_, range_width_;
  Walk walk_;
  std::vector<double> areas_;
  std::vector<Vec3> centroids_, normals_;
};

}  // namespace

ClassicalStep make_step(PinnedSurface& surface, const NonIterativeOptions& options) {
  return NonIterative(surface, options.spatial_width, options.range_width);
}

}  // namespace crease
