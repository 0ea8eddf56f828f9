#pragma once

#include <span>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"
#include "core/options/options.h"
#include "core/solve/run.h"

namespace crease {

/// Denoises `measured` by the method of the options: a Markov random field, or a classical method as a run of one sweep
/// per iteration without labels. `weights` of the likelihood per vertex, empty for 1 everywhere; a classical method has
/// no use for them. The same mesh, options and seed give the same bits for any number of threads, and through any
/// number of checkpoints. A mesh without extent comes back as it is. \throw CheckpointError
SmoothResult smooth(const Mesh& measured, const Topology& topology, const SmoothOptions& options, RunContext& context,
                    std::span<const double> weights = {});

}  // namespace crease
