#pragma once

#include <span>

#include "core/mesh/topology.h"
#include "core/options/options.h"
#include "core/solve/run.h"

namespace crease {

/// solver=descent: everything that the options leave open is estimated from the mesh as a whole. `weights` of the
/// likelihood per vertex, relative; empty for 1 everywhere. The same bits for any number of threads, and through any
/// number of checkpoints. \throw CheckpointError
SmoothResult smooth_automatically(const Mesh& measured, const Topology& topology, const MrfOptions& options,
                                  std::uint32_t threads, RunContext& context, std::span<const double> weights);

}  // namespace crease
