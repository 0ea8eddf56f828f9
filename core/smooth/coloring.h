#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh/topology.h"

namespace crease {

/// Sites in groups that can be updated at once: no two sites of a group are neighbours in their Markov random field.
struct Coloring {
  std::vector<Index> sites;         ///< group after group
  std::vector<std::size_t> starts;  ///< number of groups + 1

  std::size_t groups() const { return starts.size() - 1; }
};

/// Vertices that have faces. Neighbours share a face or face each other across an interior edge (§3.2, Fig. 1).
Coloring color_vertices(const Mesh& mesh, const Topology& topology);

/// Interior edges. Neighbours share a vertex (§3.3, Fig. 2). Edges beyond the 64th colour, as round a vertex of very
/// many edges, follow in groups of one.
Coloring color_edges(const Topology& topology);

}  // namespace crease
