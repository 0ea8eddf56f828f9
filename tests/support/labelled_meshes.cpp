#include "tests/support/labelled_meshes.h"

#include <cmath>

namespace crease::test {

LabelledMesh labelled(const Mesh& mesh) {
  const Topology topology = build_topology(mesh);
  LabelledMesh result{mesh, topology.edges, {}, signed_dihedral_angles(mesh, topology, mesh.positions)};
  for (const double angle : result.dihedral_rad) result.labels.push_back(std::abs(angle) > 25.0 / 180 * M_PI ? 1 : 0.1);
  return result;
}

std::vector<double> random_labels(const Topology& topology, std::mt19937& random) {
  std::uniform_real_distribution<double> anywhere(0, 1);
  std::vector<double> labels(topology.edges.size(), 0);
  for (Index e = 0; e < labels.size(); ++e) {
    const double label = anywhere(random);
    labels[e] = topology.is_interior(e) ? label : 0;
  }
  return labels;
}

}  // namespace crease::test
