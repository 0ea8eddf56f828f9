#pragma once

#include <span>
#include <vector>

#include "core/energy/field.h"
#include "core/geometry/lanes.h"
#include "core/geometry/rings.h"

namespace crease {

/// A proposed new position of a vertex, with the normals that its faces would then have. One object serves many
/// proposals, so that its memory is reused.
class VertexMove {
 public:
  explicit VertexMove(const Rings& rings) : normals_(rings.longest) {}

  /// Starts a proposal: `vertex`, whose ring is `ring`, moves by `displacement`. The field does not change.
  CREASE_LANES_INLINE void begin(const Field& field, Index vertex, std::span<const Rings::Block> ring,
                                 const Vec3& displacement);
  /// Accepts the proposal: writes the position and the normals to the field.
  void apply(Field& field) const;

  Index vertex() const { return vertex_; }
  const Vec3& to() const { return to_; }
  std::span<const Rings::Block> ring() const { return ring_; }
  /// The normals after the move, for each block of the ring.
  const LaneVectors* normals() const { return normals_.data(); }

  /// Calls `visit(face, normal after the move)` for the faces of the vertex.
  template <typename Visit>
  void for_each_face(Visit visit) const {
    const LaneVectors* normals = normals_.data();
    for (const Rings::Block& block : ring_) {
      for (std::size_t lane = 1; lane <= block.face_count; ++lane) {
        visit(block.faces[lane], UnitNormal(normals->x[lane], normals->y[lane], normals->z[lane], 0));
      }
      ++normals;
    }
  }

 private:
  Index vertex_ = kNone;
  Vec3 to_ = Vec3::Zero();
  std::span<const Rings::Block> ring_;
  std::vector<LaneVectors> normals_;
};

namespace detail {

/// The vector from `origin` to `point`, rounded to single precision after the subtraction.
CREASE_LANES_INLINE HalfLanes from(const Vec3& origin, const Vec3& point) {
  return HalfLanes{static_cast<float>(point.x() - origin.x()), static_cast<float>(point.y() - origin.y()),
                   static_cast<float>(point.z() - origin.z()), 0};
}

CREASE_LANES_INLINE LaneVectors in_every_lane(const Vec3& v) {
  const auto x = static_cast<float>(v.x()), y = static_cast<float>(v.y()), z = static_cast<float>(v.z());
  return {x + Lanes{}, y + Lanes{}, z + Lanes{}};
}

CREASE_LANES_INLINE LaneVectors unit_normals(const LaneVectors& a, const LaneVectors& b) {
  const LaneVectors normals = cross(a, b);
  return 1.0F / sqrt(normals.squared_norm() + kNoArea) * normals;
}

}  // namespace detail

CREASE_LANES_INLINE void VertexMove::begin(const Field& field, Index vertex, std::span<const Rings::Block> ring,
                                           const Vec3& displacement) {
  const Vec3& here = field.positions[vertex];
  vertex_ = vertex;
  to_ = here + displacement;
  ring_ = ring;
  const LaneVectors step = detail::in_every_lane(displacement);
  LaneVectors* normals = normals_.data();
  for (const Rings::Block& block : ring) {
    const LaneVectors spokes =
        transposed([&](std::size_t k) { return detail::from(here, field.positions[block.points[k]]); }) - step;
    const LaneVectors moved = detail::unit_normals(spokes, shifted_down(spokes));
    // Member by member: the compiler copies a whole struct through other registers.
    normals->x = moved.x;
    normals->y = moved.y;
    normals->z = moved.z;
    ++normals;
  }
}

inline void VertexMove::apply(Field& field) const {
  field.positions[vertex_] = to_;
  for_each_face([&](Index face, const UnitNormal& normal) { field.normals[face] = normal; });
}

}  // namespace crease
