#include "tests/support/smooth_support.h"

#include <random>

#include "core/smooth/smooth.h"

namespace crease::test {

Field shaken_field(const Mesh& mesh, const Topology& topology, unsigned seed, const MrfOptions& options,
                   std::span<const double> weights) {
  Field field(mesh, topology, options, weights);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> anywhere(0, 1), either_side(-0.1, 0.1);
  for (Vec3& position : field.positions) {
    position += Vec3(either_side(random), either_side(random), either_side(random));
  }
  for (std::size_t e = 0; e < field.labels.size(); ++e) {
    field.labels[e] = topology.is_interior(e) ? anywhere(random) : 0;
  }
  ThreadTeam alone(1);
  field.update_normals(alone);
  return field;
}

Measurement measure_smoothed(const Mesh& noisy, const Mesh& original, const MrfOptions& options) {
  const Topology topology = build_topology(noisy);
  RunContext context;
  const SmoothResult result = smooth(noisy, topology, {options}, context);
  const Mesh smoothed{result.positions, noisy.triangles};
  const EdgeLabels labels{topology.edges, result.labels};
  return measure(original, smoothed, &labels);
}

}  // namespace crease::test
