#include "core/energy/ridge_line.h"

#include "core/energy/points.h"

namespace crease {
namespace {

constexpr std::array<Index, 2> kNoLine{kNone, kNone};

std::array<Index, 2> ridge_neighbors(const Field& field, Index vertex) {
  std::array<Index, 2> neighbors = kNoLine;
  std::size_t count = 0;
  for (const Index e : field.topology.vertex_edges[vertex]) {
    if (!is_ridge(field.labels[e])) continue;
    if (count == neighbors.size()) return kNoLine;
    neighbors[count++] = other_end(field.topology.edges[e], vertex);
  }
  return count == neighbors.size() ? neighbors : kNoLine;
}

}  // namespace

RidgeLineTerm::RidgeLineTerm(const TermSetup& setup)
    : topology_(setup.field.topology), neighbors_(setup.field.positions.size(), kNoLine) {}

void RidgeLineTerm::labels_changed(const Field& field, ThreadTeam& team) {
  team.run(neighbors_.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t v = begin; v < end; ++v) neighbors_[v] = ridge_neighbors(field, static_cast<Index>(v));
  });
}

double RidgeLineTerm::energy(const Field& field, ThreadTeam& team) const {
  return block_sum<double>(field.positions.size(), team,
                           [&](std::size_t v) { return at_positions(FieldPoints{field}, static_cast<Index>(v)); });
}

double RidgeLineTerm::change(const Field& field, const VertexMove& move) const {
  const Vec3 step = move.to() - field.positions[move.vertex()];
  double change = 0;
  visit_terms(move.vertex(), [&](Index v, double times) {
    const Vec3 before = second_difference(FieldPoints{field}, v);
    change += (before + times * step).squaredNorm() - before.squaredNorm();
  });
  return change;
}

}  // namespace crease
