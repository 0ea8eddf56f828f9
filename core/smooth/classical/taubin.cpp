#include <vector>

#include "core/smooth/classical/methods.h"

namespace crease {
namespace {

/// λ|μ smoothing: a step of the umbrella operator inwards, and a longer one outwards [Taubin 1995].
class Taubin {
 public:
  Taubin(PinnedSurface& surface, double lambda, double passband)
      : surface_(surface), lambda_(lambda), mu_(lambda / (passband * lambda - 1)), next_(surface.positions) {}

  bool operator()() {
    move(lambda_);
    move(mu_);
    return true;
  }

 private:
  void move(double factor) {
    for (const Index v : surface_.movable) {
      const Vec3& here = surface_.positions[v];
      Vec3 sum = Vec3::Zero();
      surface_.visit_vertex_neighbors(v, [&](Index neighbor) { sum += surface_.positions[neighbor] - here; });
      next_[v] = here + factor / static_cast<double>(surface_.topology.vertex_edges[v].size()) * sum;
    }
    surface_.positions.swap(next_);
  }

  PinnedSurface& surface_;
  double lambda_, mu_;
  std::vector<Vec3> next_;
};

}  // namespace

ClassicalStep make_step(PinnedSurface& surface, const TaubinOptions& options) {
  return Taubin(surface, options.step, options.passband);
}

}  // namespace crease
