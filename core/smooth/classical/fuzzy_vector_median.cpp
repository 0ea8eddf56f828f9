#include "core/smooth/classical/fuzzy_vector_median.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/smooth/classical/methods.h"
#include "core/smooth/classical/walk.h"

namespace crease {
namespace {

/// Sum of distances to all of `normals`, or some number of at least `enough`.
double distance_sum(const Vec3& normal, std::span<const Vec3> normals, double enough) {
  double sum = 0;
  for (const Vec3& other : normals) {
    sum += (normal - other).norm();
    if (sum >= enough) break;
  }
  return sum;
}

Vec3 vector_median(std::span<const Vec3> normals) {
  Vec3 median = Vec3::Zero();
  double least = std::numeric_limits<double>::infinity();
  for (const Vec3& normal : normals) {
    if (normal.isZero(0)) continue;
    const double sum = distance_sum(normal, normals, least);
    if (sum < least) {
      least = sum;
      median = normal;
    }
  }
  return median;
}

/// Per face itself and the faces that share a vertex with it, as far as interior edges lead to them.
IndexRows face_windows(const PinnedSurface& surface) {
  IndexRows windows;
  Walk walk(surface.faces.size());
  for (Index face = 0; face < surface.faces.size(); ++face) {
    const auto touches = [&](Index other) {
      const Triangle& corners = surface.faces[face];
      return std::ranges::find_first_of(surface.faces[other], corners) != surface.faces[other].end();
    };
    const auto visit_neighbors = [&](Index f, auto visit) { surface.visit_face_neighbors(f, visit); };
    for (const Index f : walk.from({&face, 1}, visit_neighbors, touches)) windows.items.push_back(f);
    windows.starts.push_back(static_cast<Index>(windows.items.size()));
  }
  return windows;
}

/// The normals of all faces become fuzzy vector medians, then the vertices follow them.
class FuzzyVectorMedian {
 public:
  FuzzyVectorMedian(PinnedSurface& surface, double width, std::uint32_t fitting_steps)
      : surface_(surface), width_(width), fitting_steps_(fitting_steps), windows_(face_windows(surface)) {
    filtered_.resize(surface.faces.size());
  }

  bool operator()() {
    surface_.normals_of_faces(normals_);
    for (std::size_t f = 0; f < filtered_.size(); ++f) {
      window_.clear();
      for (const Index other : windows_[f]) window_.push_back(normals_[other]);
      filtered_[f] = fuzzy_vector_median(window_, width_);
    }
    fit_to_normals(surface_, filtered_, fitting_steps_);
    return true;
  }

 private:
  PinnedSurface& surface_;
  double width_;
  std::uint32_t fitting_steps_;
  IndexRows windows_;
  std::vector<Vec3> normals_, filtered_, window_;
};

}  // namespace

Vec3 fuzzy_vector_median(std::span<const Vec3> normals, double width) {
  const Vec3 median = vector_median(normals);
  Vec3 sum = Vec3::Zero();
  for (const Vec3& normal : normals) {
    if (!normal.isZero(0)) sum += std::exp(-(normal - median).squaredNorm() / (2 * width * width)) * normal;
  }
  return direction(sum);
}

ClassicalStep make_step(PinnedSurface& surface, const FuzzyVectorMedianOptions& options) {
  return FuzzyVectorMedian(surface, options.normal_width, options.fitting_steps);
}

}  // namespace crease
