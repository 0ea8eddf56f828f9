#include "core/smooth/ridge_straightness.h"

namespace crease {
namespace {

constexpr std::size_t kChunk = 4096;
constexpr std::array<Index, 2> kNoLine{kNone, kNone};

std::array<Index, 2> ridge_neighbors(const Field& field, Index vertex) {
  std::array<Index, 2> neighbors = kNoLine;
  std::size_t count = 0;
  for (const Index e : field.topology.vertex_edges[vertex]) {
    if (field.labels[e] < kRidgeThreshold) continue;
    if (count == neighbors.size()) return kNoLine;
    neighbors[count++] = other_end(field.topology.edges[e], vertex);
  }
  return count == neighbors.size() ? neighbors : kNoLine;
}

}  // namespace

RidgeStraightness::RidgeStraightness(const Field& field, ThreadTeam& team)
    : neighbors_(field.positions.size(), kNoLine) {
  team.run(neighbors_.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t v = begin; v < end; ++v) neighbors_[v] = ridge_neighbors(field, static_cast<Index>(v));
  });
}

Vec3 RidgeStraightness::second_difference(const Field& field, Index vertex) const {
  const auto [a, b] = neighbors_[vertex];
  return field.positions[a] - 2 * field.positions[vertex] + field.positions[b];
}

double RidgeStraightness::energy(const Field& field, Index vertex) const {
  return has_term(vertex) ? second_difference(field, vertex).squaredNorm() : 0;
}

template <typename Visit>
void RidgeStraightness::visit_terms(const Field& field, Index vertex, Visit visit) const {
  if (has_term(vertex)) visit(vertex, -2.0);
  for (const Index e : field.topology.vertex_edges[vertex]) {
    const Index other = other_end(field.topology.edges[e], vertex);
    if (has_term(other) && (neighbors_[other][0] == vertex || neighbors_[other][1] == vertex)) visit(other, 1.0);
  }
}

double RidgeStraightness::change(const Field& field, Index vertex, const Vec3& to) const {
  const Vec3 step = to - field.positions[vertex];
  double change = 0;
  visit_terms(field, vertex, [&](Index v, double times) {
    const Vec3 before = second_difference(field, v);
    change += (before + times * step).squaredNorm() - before.squaredNorm();
  });
  return change;
}

Vec3 RidgeStraightness::gradient(const Field& field, Index vertex) const {
  Vec3 gradient = Vec3::Zero();
  visit_terms(field, vertex, [&](Index v, double times) { gradient += 2 * times * second_difference(field, v); });
  return gradient;
}

}  // namespace crease
