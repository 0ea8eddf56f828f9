#pragma once

#include <vector>

#include "core/geometry/surface.h"

namespace crease {

/// A part of a surface, numbered anew.
struct Patches {
  Mesh mesh;                    ///< positions in ℓ, faces wound as those of the surface
  std::vector<Index> vertices;  ///< per vertex of `mesh`: its number in the surface
};

/// About `faces` faces of a surface, in four connected patches that start at evenly spaced faces.
Patches cut_patches(const Surface& surface, std::size_t faces);

}  // namespace crease
