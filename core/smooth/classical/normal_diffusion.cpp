#include <cmath>
#include <vector>

#include "core/smooth/classical/methods.h"

namespace crease {
namespace {

/// Explicit diffusion over the three neighbours of a face is stable up to 1/3.
constexpr double kLongestStep = 0.25;

/// Diffusion of the normal map with a conductance that falls with the difference of adjacent normals, alternating with
/// a refit of the surface to the normals [Tasdizen et al. 2002], here over the faces of a mesh.
class NormalDiffusion {
 public:
  NormalDiffusion(PinnedSurface& surface, double time, double width, std::uint32_t fitting_steps)
      : surface_(surface),
        steps_(static_cast<std::uint32_t>(std::ceil(time / kLongestStep))),
        step_(time / steps_),
        width_(width),
        fitting_steps_(fitting_steps),
        flow_(surface.faces.size()) {}

  bool operator()() {
    surface_.normals_of_faces(normals_);
    for (std::uint32_t i = 0; i < steps_; ++i) diffuse();
    fit_to_normals(surface_, normals_, fitting_steps_);
    return true;
  }

 private:
  void diffuse() {
    const Topology& topology = surface_.topology;
    flow_.assign(flow_.size(), Vec3::Zero());
    for (std::size_t e = 0; e < topology.edges.size(); ++e) {
      if (!topology.is_interior(e)) continue;
      const auto [f0, f1] = topology.edge_faces[e];
      const Vec3 difference = normals_[f1] - normals_[f0];
      const Vec3 flow = std::exp(-difference.squaredNorm() / (2 * width_ * width_)) * difference;
      flow_[f0] += flow;
      flow_[f1] -= flow;
    }
    for (std::size_t f = 0; f < flow_.size(); ++f) normals_[f] = direction(normals_[f] + step_ * flow_[f]);
  }

  PinnedSurface& surface_;
  std::uint32_t steps_;
  double step_, width_;
  std::uint32_t fitting_steps_;
  std::vector<Vec3> normals_, flow_;
};

}  // namespace

ClassicalStep make_step(PinnedSurface& surface, const NormalDiffusionOptions& options) {
  return NormalDiffusion(surface, options.step, options.normal_width, options.fitting_steps);
}

}  // namespace crease
