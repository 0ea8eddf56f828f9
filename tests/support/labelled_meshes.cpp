#include "tests/support/labelled_meshes.h"

#include <cmath>

namespace crease::test {

LabelledMesh labelled(const Mesh& mesh) {
  const Topology topology = build_topology(mesh);
  LabelledMesh result{mesh, topology.edges, {}, signed_dihedral_angles(mesh, topology, mesh.positions)};
  for (const double angle : result.dihedral_rad) result.labels.push_back(std::abs(angle) > 25.0 / 180 * M_PI ? 1 : 0.1);
  return result;
}

}  // namespace crease::test
