#pragma once

#include <cstdint>
#include <functional>

#include "core/smooth/classical/methods.h"
#include "core/solve/run.h"

namespace crease {

/// Runs a classical method on `measured`, one sweep per iteration and without labels: up to `iterations` calls of the
/// step that `make_step` makes for the surface. The same input gives the same bits; moving, turning or scaling it does
/// so to the result.
SmoothResult iterate(const Mesh& measured, const Topology& topology, std::uint32_t iterations,
                     const std::function<ClassicalStep(PinnedSurface&)>& make_step, RunContext& context);

}  // namespace crease
