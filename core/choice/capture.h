#pragma once

#include "core/geometry/surface.h"

namespace crease {

/// What a mesh shows of how it was captured.
struct CaptureSigns {
  double exact_flats = 0;  ///< share of the inner edges whose faces are in one plane to the last bit
  double facing = 0;       ///< share of the area that faces the way most of it does: 1 in one view, 1/2 if closed
  double regular = 0;      ///< share of the vertices that have six faces, as most on a grid of pixels have

  /// Whether this may be what one depth camera saw: all of it faces one side, on a grid.
  bool is_one_view() const;
};

CaptureSigns capture_signs(const Surface& surface);

}  // namespace crease
