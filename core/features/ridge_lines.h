#pragma once

#include <vector>

#include "core/features/vertex_classes.h"
#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// A maximal chain of ridge edges.
struct RidgeLine {
  /// From end to end along the chain. A closed line goes on from its last vertex to its first, which is not repeated.
  std::vector<Index> vertices;
  bool closed = false;
  double length = 0;             ///< in the units of the positions
  double mean_label = 0;         ///< over the edges
  double mean_dihedral_rad = 0;  ///< over the edges, + convex, − concave
};

/// Traces the edges with label ≥ kRidgeThreshold; each is in exactly one line. Lines end at corners, and at vertices
/// where the number of such edges is not two. A line without a corner, or one that returns to its only corner, is
/// closed. The lines are in the order of their first edges. An open line starts at the end with the smaller index. A
/// closed line starts at its corner, or else at its smallest vertex, and goes on to the smaller neighbour.
std::vector<RidgeLine> trace_ridges(const Topology& topology, const std::vector<Vec3>& positions,
                                    const std::vector<double>& labels, const std::vector<double>& dihedral_rad,
                                    const std::vector<VertexClass>& classes);

}  // namespace crease
