#pragma once

#include <span>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// The same mesh with vertices and faces numbered along a space-filling curve, so that what lies together on the
/// surface lies together in memory. Scans often come in no order at all, and then every visit waits for main memory.
struct Renumbering {
  explicit Renumbering(const Mesh& mesh);

  /// Values per vertex of the given mesh, as `mesh` numbers them.
  std::vector<double> renumbered(std::span<const double> values) const;

  Mesh mesh;
  std::vector<Index> new_vertex;  ///< per vertex of the given mesh
  std::vector<Index> new_face;    ///< per face of the given mesh; corners keep their order
};

/// For every edge of `topology` the same edge in `renumbered`, the topology of `renumbering.mesh`.
std::vector<Index> new_edges(const Renumbering& renumbering, const Topology& topology, const Topology& renumbered);

/// Turns faces and twists edges of `renumbered` as `topology` does: which edge of a Möbius strip is twisted is a choice
/// that numbering must not change.
void adopt_orientation(const Topology& topology, const std::vector<Index>& new_face, const std::vector<Index>& new_edge,
                       Topology& renumbered);

}  // namespace crease
