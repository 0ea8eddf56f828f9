#pragma once

#include <functional>
#include <vector>

#include "core/geometry/surface.h"
#include "core/options/options.h"

namespace crease {

/// What the classical methods move: boundaries and non-manifold edges stay, and nothing is smoothed across them.
struct PinnedSurface : Surface {
  PinnedSurface(const Mesh& mesh, const Topology& mesh_topology);

  std::vector<Index> movable;            ///< vertices that have edges, all of them interior
  std::vector<std::uint8_t> is_movable;  ///< per vertex
};

/// One iteration of a method; false when there is nothing left to gain.
using ClassicalStep = std::function<bool()>;

/// Each makes the iterations of one method over `surface`, which must outlive them.
ClassicalStep make_step(PinnedSurface& surface, const FuzzyVectorMedianOptions& options);
ClassicalStep make_step(PinnedSurface& surface, const TaubinOptions& options);
ClassicalStep make_step(PinnedSurface& surface, const MeanCurvatureFlowOptions& options);
ClassicalStep make_step(PinnedSurface& surface, const AnisotropicFlowOptions& options);
ClassicalStep make_step(PinnedSurface& surface, const NormalDiffusionOptions& options);
ClassicalStep make_step(PinnedSurface& surface, const NonIterativeOptions& options);
ClassicalStep make_step(PinnedSurface& surface, const BilateralOptions& options);

/// Moves the movable vertices until the faces look along `normals`; see vertex_fit.h.
void fit_to_normals(PinnedSurface& surface, const std::vector<Vec3>& normals, std::uint32_t steps);

}  // namespace crease
