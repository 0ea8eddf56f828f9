#pragma once

#include "core/energy/field.h"

namespace crease {

/// The positions of a field as the argument Points of at_positions() and by_position().
struct FieldPoints {
  using Vector = Vec3;
  const Field& field;
  const Vec3& operator()(Index vertex) const { return field.positions[vertex]; }
};

/// The normals of a field as the argument Normals of at_normals() and by_normal().
struct FieldNormals {
  using Vector = UnitNormal;
  const Field& field;
  const UnitNormal& operator()(Index face) const { return field.normals[face]; }
};

}  // namespace crease
