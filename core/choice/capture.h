#pragma once

#include "core/geometry/surface.h"

namespace crease {

/// What a mesh shows of how it was captured.
struct CaptureSigns {
  double exact_flats = 0;  ///< of the inner edges: faces in one plane to the last bit, without noise or rounded
  double facing = 0;       ///< of the area: looks to where most does; 1 in a view of one camera, 1/2 if closed
  double regular = 0;      ///< of the vertices: have six faces, as most do on a grid of pixels

  /// Whether this may be what one depth camera saw: all of it faces one side, on a grid.
  bool is_one_view() const;
};

CaptureSigns capture_signs(const Surface& surface);

}  // namespace crease
