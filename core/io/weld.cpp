#include "core/io/weld.h"

#include <bit>
#include <cstdint>
#include <random>

namespace crease {
namespace {

std::uint64_t mixed(std::uint64_t bits) {
  bits = (bits ^ (bits >> 32U)) * 0xd6e8feb86659fd93ULL;
  bits = (bits ^ (bits >> 32U)) * 0xd6e8feb86659fd93ULL;
  return bits ^ (bits >> 32U);
}

/// A random salt, so that no upload can be made whose positions all fall into one slot. The result of welding does not
/// depend on it.
std::uint64_t salt() {
  static const std::uint64_t value = (std::uint64_t{std::random_device{}()} << 32U) | std::random_device{}();
  return value;
}

std::uint64_t hash(const Vec3& position) {
  std::uint64_t bits = salt();
  for (const double coordinate : {position.x(), position.y(), position.z()}) {
    bits = mixed(bits ^ std::bit_cast<std::uint64_t>(coordinate + 0.0));  // −0 + 0 is +0
  }
  return bits;
}

}  // namespace

Index PositionIndex::find_or_append(std::vector<Vec3>& positions, const Vec3& position) {
  if (2 * (positions.size() + 1) > slots_.size()) grow(positions);
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = hash(position) & mask;
  for (; slots_[slot] != kNone; slot = (slot + 1) & mask) {
    if (positions[slots_[slot]] == position) return slots_[slot];
  }
  slots_[slot] = static_cast<Index>(positions.size());
  positions.push_back(position);
  return slots_[slot];
}

void PositionIndex::grow(const std::vector<Vec3>& positions) {
  constexpr std::size_t kSmallest = 64;
  slots_.assign(std::max(kSmallest, 2 * slots_.size()), kNone);
  const std::size_t mask = slots_.size() - 1;
  for (std::size_t vertex = 0; vertex < positions.size(); ++vertex) {
    std::size_t slot = hash(positions[vertex]) & mask;
    while (slots_[slot] != kNone) slot = (slot + 1) & mask;
    slots_[slot] = static_cast<Index>(vertex);
  }
}

std::size_t weld_by_position(Mesh& mesh, std::vector<double>& weights) {
  std::vector<Vec3> kept;
  std::vector<Index> index_of(mesh.positions.size());
  PositionIndex lookup;
  for (std::size_t vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    const std::size_t before = kept.size();
    index_of[vertex] = lookup.find_or_append(kept, mesh.positions[vertex]);
    if (!weights.empty() && kept.size() > before) weights[before] = weights[vertex];
  }
  const std::size_t removed = mesh.positions.size() - kept.size();
  if (removed == 0) return 0;
  for (Triangle& triangle : mesh.triangles) {
    for (Index& corner : triangle) corner = index_of[corner];
  }
  mesh.positions = std::move(kept);
  if (!weights.empty()) weights.resize(mesh.positions.size());
  return removed;
}

}  // namespace crease
