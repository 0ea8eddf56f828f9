#pragma once

#include <cstdint>
#include <vector>

#include "core/energy/term.h"
#include "core/mesh/topology.h"

namespace crease {

/// In which order the sites of a Markov random field are visited, and what may run at the same time.
///
/// The mesh is cut into blocks of neighbouring vertices. A task is the sites of one block, visited one after the other
/// on one thread while the block stays in its cache. Tasks of a phase touch no vertex in common and run side by side;
/// the phases follow each other. So the order in which neighbours see each other depends on the mesh alone, not on
/// threads.
struct Schedule {
  std::vector<Index> sites;         ///< run after run
  std::vector<std::size_t> runs;    ///< starts in `sites`, one more than there are runs
  std::vector<std::size_t> tasks;   ///< starts in `runs`, likewise
  std::vector<std::size_t> phases;  ///< starts in `tasks`, likewise
};

/// Vertices that have faces. The vertices of a run are no neighbours of each other, so that they may be computed
/// together.
Schedule schedule_vertices(const Mesh& mesh, const Topology& topology,
                           Neighborhood neighborhood = Neighborhood::kFirstOrder);

/// Faces, neighbours where they share a vertex. A task is one run, in order.
Schedule schedule_faces(const Mesh& mesh);

/// Interior edges, neighbours where they share a vertex (§3.3, Fig. 2). A task is one run, in order.
Schedule schedule_edges(const Topology& topology);

}  // namespace crease
