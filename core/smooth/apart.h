#pragma once

#include <span>

#include "core/mesh/topology.h"
#include "core/options/options.h"
#include "core/solve/run.h"

namespace crease {

/// solver=descent: what the options leave open is estimated from the mesh, and for each of its parts (parts_of) from
/// that part alone, so that a machine part, a scan, and a statue in one file each get what suits them. `weights` of the
/// likelihood per vertex, empty for 1 everywhere; where the noise is estimated, they count within a part. The same bits
/// for any number of threads, and through any number of checkpoints. \throw CheckpointError
SmoothResult smooth_apart(const Mesh& measured, const Topology& topology, const MrfOptions& options,
                          std::uint32_t threads, RunContext& context, std::span<const double> weights);

}  // namespace crease
