#pragma once

#include <span>
#include <vector>

#include "core/base/thread_team.h"
#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// The same mesh with vertices and faces numbered along a space-filling curve, so that neighbours on the surface are
/// neighbours in memory. Scans often have a random order, which makes nearly every visit a cache miss.
struct Renumbering {
  explicit Renumbering(const Mesh& mesh, ThreadTeam& team = calling_thread());

  /// Reorders values per vertex from the given mesh to `mesh`.
  std::vector<double> renumbered(std::span<const double> values) const;

  Mesh mesh;
  std::vector<Index> new_vertex;  ///< per vertex of the given mesh
  std::vector<Index> new_face;    ///< per face of the given mesh; corners keep their order
};

/// The topology of a renumbered mesh, and the new number of each edge.
struct RenumberedTopology {
  /// It has the orientation of `given`: which edge of a Möbius strip is twisted is arbitrary, and must not depend on
  /// the numbering.
  RenumberedTopology(const Renumbering& renumbering, const Topology& given, ThreadTeam& team = calling_thread());

  Topology topology;
  std::vector<Index> new_edge;
};

}  // namespace crease
