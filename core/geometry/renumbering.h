#pragma once

#include <span>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// The same mesh with vertices and faces numbered along a space-filling curve, so that neighbours on the surface are
/// neighbours in memory. Scans often have a random order, which makes nearly every visit a cache miss.
struct Renumbering {
  explicit Renumbering(const Mesh& mesh);

  /// Reorders values per vertex from the given mesh to `mesh`.
  std::vector<double> renumbered(std::span<const double> values) const;

  Mesh mesh;
  std::vector<Index> new_vertex;  ///< per vertex of the given mesh
  std::vector<Index> new_face;    ///< per face of the given mesh; corners keep their order
};

/// Maps each edge of `topology` to the same edge of `renumbered`, the topology of `renumbering.mesh`.
std::vector<Index> new_edges(const Renumbering& renumbering, const Topology& topology, const Topology& renumbered);

/// Copies the flipped faces and twisted edges of `topology` to `renumbered`. Which edge of a Möbius strip is twisted is
/// arbitrary, and must not depend on the numbering.
void adopt_orientation(const Topology& topology, const std::vector<Index>& new_face, const std::vector<Index>& new_edge,
                       Topology& renumbered);

}  // namespace crease
