#include "tests/support/smooth_support.h"

#include <random>

#include "core/smooth/smooth.h"

namespace crease::test {

Field shaken_field(const Mesh& mesh, const Topology& topology, unsigned seed) {
  Field field(mesh, topology);
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

FieldWithEnergy::FieldWithEnergy(Field start, const MrfOptions& options, std::span<const double> vertex_weights)
    : field(std::move(start)), terms({field, options, vertex_weights}) {
  update();
}

void FieldWithEnergy::update() {
  field.update_normals(alone);
  field.update_edges(alone);
  terms.positions_changed(field, alone);
  terms.labels_changed(field, alone);
}

Energy energy_of(const Field& field, const MrfOptions& options, std::span<const double> vertex_weights) {
  return FieldWithEnergy(field, options, vertex_weights).energy();
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
