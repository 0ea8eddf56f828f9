#pragma once

#include "core/energy/field.h"

namespace crease {

/// The positions of a field as the terms' functions of all positions read them.
struct FieldPoints {
  using Vector = Vec3;
  const Field& field;
  const Vec3& operator()(Index vertex) const { return field.positions[vertex]; }
};

/// The same for the normals.
struct FieldNormals {
  using Vector = UnitNormal;
  const Field& field;
  const UnitNormal& operator()(Index face) const { return field.normals[face]; }
};

}  // namespace crease
