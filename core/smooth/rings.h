#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/smooth/field.h"
#include "core/smooth/schedule.h"

namespace crease {

/// What the vertex process needs to see round each vertex (§3.2, Fig. 1), laid out in the order of the visits.
///
/// The faces at a vertex form fans. A fan is a run of lanes; lane k holds the ring's k-th point and the face between it
/// and the point of lane k + 1. A closed fan begins with a copy of its last face, so that every pair of neighbouring
/// faces is a pair of neighbouring lanes. Then a visit is a few straight loops without a branch.
struct Rings {
  struct Lane {
    Index point = kNone;
    Index face = kNone;        ///< kNone: no face between this point and the next
    Index outer_face = 0;      ///< beyond the rim edge, facing the vertex
    Index rim_edge = kNone;    ///< between the lane's two points; `no_edge` where the prior has no term
    Index spoke_edge = kNone;  ///< between the faces of the lane before and of this one; `no_edge` likewise
  };

  Rings(const Field& field, const Schedule& schedule);

  std::span<const Lane> operator[](std::size_t slot) const {
    return {lanes.data() + starts[slot], lanes.data() + starts[slot + 1]};
  }

  std::vector<Lane> lanes;
  std::vector<std::size_t> starts;  ///< per site of the schedule
  std::size_t longest = 0;
  Index no_edge = 0;  ///< one past the last edge
};

}  // namespace crease
