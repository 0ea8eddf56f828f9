#pragma once

#include <vector>

#include "core/base/thread_team.h"
#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// Vertices that stick out of a scan by themselves, in ascending order. Such a vertex is six times as far from the mean
/// of its neighbours as is usual, and further than they are from each other; and where it moves there, the edges around
/// it bend less than 0.6 times as much: those around a corner or the tip of a cone bend more. Where more than two in a
/// hundred vertices are like that, none is a spike. Two that are neighbours are not found.
std::vector<Index> find_spikes(const Mesh& mesh, const Topology& topology, ThreadTeam& team = calling_thread());

/// Moves each spike to the mean of its neighbours, and returns how many there are. A mesh without noise stays as it is:
/// what sticks out there is shape.
std::size_t flatten_spikes(Mesh& mesh, const Topology& topology, ThreadTeam& team = calling_thread());

}  // namespace crease
