#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"
#include "core/options/options.h"

namespace crease {

struct ClassicalResult {
  std::vector<Vec3> positions;   ///< in the units of the upload; vertices that did not move come back exactly
  std::uint32_t iterations = 0;  ///< fewer than asked for when cancelled or converged
  double seconds = 0;
  bool cancelled = false;
};

/// A view of a run after an iteration; valid during the call only.
struct ClassicalView {
  std::uint32_t iteration = 0;   ///< from 1
  std::uint32_t iterations = 0;  ///< how many there are to be
  double seconds = 0;
  std::function<std::vector<Vec3>()> positions;  ///< in the units of the upload, made when called
};

/// Called after every iteration. Returns false to stop.
using ClassicalCallback = std::function<bool(const ClassicalView&)>;

/// Denoises `measured` by `method`. Boundaries and non-manifold edges stay: their vertices do not move and nothing is
/// smoothed across them. The same input gives the same bits; moving, turning or scaling it does so to the result.
ClassicalResult denoise(const Mesh& measured, const Topology& topology, const ClassicalMethod& method,
                        const ClassicalCallback& on_iteration = {});

}  // namespace crease
