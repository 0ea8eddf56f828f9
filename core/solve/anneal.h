#pragma once

#include <cstdint>
#include <span>

#include "core/solve/run.h"

namespace crease {

/// The coupled processes of §3.4, annealed (§3.5). `threads` 0: as many as the machine has. `weights` of the likelihood
/// per vertex, empty for 1 everywhere. The same mesh, options and seed give the same bits for any number of threads,
/// and through any number of checkpoints. \throw CheckpointError
SmoothResult anneal(const Mesh& measured, const Topology& topology, const MrfOptions& options, std::uint32_t threads,
                    RunContext& context, std::span<const double> weights);

}  // namespace crease
