#include "core/mesh/position_index.h"

#include <algorithm>
#include <bit>
#include <random>
#include <utility>

namespace crease {
namespace {

std::uint64_t mixed(std::uint64_t bits) {
  bits = (bits ^ (bits >> 32U)) * 0xd6e8feb86659fd93ULL;
  bits = (bits ^ (bits >> 32U)) * 0xd6e8feb86659fd93ULL;
  return bits ^ (bits >> 32U);
}

std::uint64_t salt() {
  static const std::uint64_t value = (std::uint64_t{std::random_device{}()} << 32U) | std::random_device{}();
  return value;
}

std::uint64_t hash(const Vec3& position) {
  const auto bits = [](double coordinate) {
    return std::bit_cast<std::uint64_t>(coordinate + 0.0);  // −0 + 0 is +0
  };
  return salted_hash(bits(position.x()), bits(position.y()), bits(position.z()));
}

constexpr std::size_t kSmallestTable = 64;

}  // namespace

std::uint64_t salted_hash(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  return mixed(mixed(mixed(salt() ^ a) ^ b) ^ c);
}

void PositionIndex::reserve(std::size_t count, const std::vector<Vec3>& positions) {
  // At most three of four slots are taken.
  const std::size_t wanted = std::bit_ceil(std::max(kSmallestTable, count + count / 3 + 1));
  if (wanted > slots_.size()) grow(wanted, positions);
}

Index PositionIndex::find_or_append(std::vector<Vec3>& positions, const Vec3& position) {
  for (const Index vertex : recent_) {
    if (vertex < used_ && positions[vertex] == position) return vertex;
  }
  reserve(used_ + 1, positions);
  Slot& slot = slot_for(positions, position);
  if (slot.vertex == kNone) {
    slot.vertex = static_cast<Index>(positions.size());
    positions.push_back(position);
    ++used_;
  }
  recent_[next_recent_++ % recent_.size()] = slot.vertex;
  return slot.vertex;
}

Index PositionIndex::find_or_add(const std::vector<Vec3>& positions, Index vertex) {
  reserve(used_ + 1, positions);
  Slot& slot = slot_for(positions, positions[vertex]);
  if (slot.vertex == kNone) {
    slot.vertex = vertex;
    ++used_;
  }
  return slot.vertex;
}

/// The slot of the vertex at `position`, or the empty one that it would get, which already has its tag.
PositionIndex::Slot& PositionIndex::slot_for(const std::vector<Vec3>& positions, const Vec3& position) {
  const std::uint64_t code = hash(position);
  const auto tag = static_cast<std::uint32_t>(code >> 32U);
  const std::size_t mask = slots_.size() - 1;
  std::size_t at = code & mask;
  for (; slots_[at].vertex != kNone; at = (at + 1) & mask) {
    if (slots_[at].tag == tag && positions[slots_[at].vertex] == position) return slots_[at];
  }
  slots_[at].tag = tag;
  return slots_[at];
}

void PositionIndex::grow(std::size_t slots, const std::vector<Vec3>& positions) {
  const std::vector<Slot> old = std::exchange(slots_, std::vector<Slot>(slots));
  const std::size_t mask = slots - 1;
  for (const Slot& slot : old) {
    if (slot.vertex == kNone) continue;
    std::size_t at = hash(positions[slot.vertex]) & mask;
    while (slots_[at].vertex != kNone) at = (at + 1) & mask;
    slots_[at] = slot;
  }
}

std::vector<Index> weld_by_position(Mesh& mesh, std::vector<double>& weights) {
  std::vector<Vec3> kept;
  std::vector<Index> index_of(mesh.positions.size());
  PositionIndex lookup;
  lookup.reserve(mesh.positions.size(), kept);
  for (std::size_t vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    const std::size_t before = kept.size();
    index_of[vertex] = lookup.find_or_append(kept, mesh.positions[vertex]);
    if (!weights.empty() && kept.size() > before) weights[before] = weights[vertex];
  }
  if (kept.size() == mesh.positions.size()) return index_of;
  for (Triangle& triangle : mesh.triangles) {
    for (Index& corner : triangle) corner = index_of[corner];
  }
  mesh.positions = std::move(kept);
  if (!weights.empty()) weights.resize(mesh.positions.size());
  return index_of;
}

}  // namespace crease
