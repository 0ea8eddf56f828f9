#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/geometry/surface.h"
#include "core/graduated/flat_mesh.h"

namespace crease {

/// A part of a surface, numbered anew.
struct Patches {
  Mesh mesh;                    ///< positions in ℓ, faces wound as those of the surface
  std::vector<Index> vertices;  ///< per vertex of `mesh`: its number in the surface
};

/// About `faces` faces of a surface, in four connected patches that start at evenly spaced faces.
Patches cut_patches(const Surface& surface, std::size_t faces);

/// What is tried in place of a mesh that is too large to be tried as a whole.
struct TrialPatches {
  Patches patches;
  FlatMesh mesh;
  std::vector<float> precisions;  ///< of the likelihood per vertex; empty for 1
};

/// None where the mesh is small enough. `precisions` per vertex of the surface, empty for 1.
std::optional<TrialPatches> cut_for_trials(const Surface& surface, std::span<const float> precisions);

}  // namespace crease
