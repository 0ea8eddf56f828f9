#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/mesh/mesh.h"

namespace crease {

/// A well-mixed hash of three 64-bit values. It has a random salt, so that no upload can be made whose elements all
/// fall into one slot of a table. No result depends on it.
std::uint64_t salted_hash(std::uint64_t a, std::uint64_t b, std::uint64_t c);

/// Finds vertices by their exact position; 0 and −0 are the same. Positions must be finite.
class PositionIndex {
 public:
  /// Makes room for `count` positions.
  void reserve(std::size_t count, const std::vector<Vec3>& positions);

  /// Returns the vertex of `positions` exactly at `position`, and appends it if there is none. All of `positions` must
  /// have been added by this function.
  Index find_or_append(std::vector<Vec3>& positions, const Vec3& position);

  /// Returns the first vertex added that is exactly at the position of `vertex`, and adds `vertex` if there is none.
  Index find_or_add(const std::vector<Vec3>& positions, Index vertex);

 private:
  /// A vertex with a part of its hash, which tells most other positions apart without looking at them.
  struct Slot {
    Index vertex = kNone;
    std::uint32_t tag = 0;
  };

  Slot& slot_for(const std::vector<Vec3>& positions, const Vec3& position);
  void grow(std::size_t slots, const std::vector<Vec3>& positions);

  std::vector<Slot> slots_;
  std::size_t used_ = 0;
  std::array<Index, 4> recent_{kNone, kNone, kNone, kNone};  ///< neighbouring facets share corners
  std::size_t next_recent_ = 0;
};

/// Merges vertices at exactly the same position. The first of them keeps its place in the order and its weight.
/// `weights` has one per vertex, or is empty. Returns the new number of each vertex.
std::vector<Index> weld_by_position(Mesh& mesh, std::vector<double>& weights);

}  // namespace crease
