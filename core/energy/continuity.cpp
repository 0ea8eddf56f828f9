#include "core/energy/continuity.h"

namespace crease {

double ContinuityTerm::slope(const Field& field, Index edge) const {
  const Topology& topology = field.topology;
  double slope = 0;
  for (const Index vertex : {topology.edges[edge].v0, topology.edges[edge].v1}) {
    for (const Index other : topology.vertex_edges[vertex]) {
      if (other == edge || field.labels[other] == 0) continue;
      const bool both_out = (topology.edges[edge].v0 == vertex) == (topology.edges[other].v0 == vertex);
      const double cosine = field.edges.direction[edge].dot(field.edges.direction[other]);
      const double cos_turning = both_out ? -cosine : cosine;
      if (cos_turning <= 0) continue;
      const double change = field.edges.angle[edge] - field.edges.angle[other];
      slope += cos_turning * field.labels[other] * change * change;
    }
  }
  return slope;
}

/// Every pair is met from both of its edges.
double ContinuityTerm::energy(const Field& field, ThreadTeam& team) const {
  return block_sum<double>(field.labels.size(), team,
                           [&](std::size_t e) { return field.labels[e] * slope(field, static_cast<Index>(e)); }) /
         2;
}

}  // namespace crease
