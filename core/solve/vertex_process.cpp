#include "core/solve/vertex_process.h"

#include <algorithm>
#include <array>

namespace crease {

VertexProcess::VertexProcess(Field& field, const EnergyTerms& terms, const Schedule& schedule, std::size_t threads)
    : field_(field),
      terms_(terms),
      schedule_(schedule),
      rings_(field, schedule.sites),
      moves_(threads * kBatch, VertexMove(rings_)) {}

double VertexProcess::delta_energy(std::size_t slot, const Vec3& position, const Weights& weights) {
  const Index vertex = schedule_.sites[slot];
  moves_[0].begin(field_, vertex, rings_[slot], position - field_.positions[vertex]);
  return terms_.change(field_, weights, moves_[0]);
}

CREASE_WIDE_CLONES void VertexProcess::propose_batch(std::span<VertexMove, kBatch> moves, const Weights& weights,
                                                     std::size_t first, const CounterRandom& random,
                                                     std::uint32_t sweep_index, double step, Batch& batch) const {
  std::array<Index, kBatch> sites{};
  std::copy_n(&schedule_.sites[first], batch.count, sites.begin());
  const auto words = random(sweep_index, sites);
  std::array<std::array<double, kBatch>, 3> displacement;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < kBatch; ++i) displacement[axis][i] = step * CounterRandom::symmetric(words[axis][i]);
  }
  batch.word = words[3];
  for (std::size_t i = 0; i < batch.count; ++i) {
    moves[i].begin(field_, sites[i], rings_[first + i], {displacement[0][i], displacement[1][i], displacement[2][i]});
    batch.delta[i] = terms_.change(field_, weights, moves[i]);
  }
}

ProposalCount VertexProcess::sweep(const Weights& weights, const CounterRandom& random, std::uint32_t sweep_index,
                                   double temperature, double step, ThreadTeam& team) {
  return metropolis_sweep(schedule_, team, [&](std::size_t begin, std::size_t end, std::size_t thread) {
    const std::span<VertexMove, kBatch> moves(moves_.data() + thread * kBatch, kBatch);
    Batch batch;
    std::uint64_t accepted = 0;
    for (std::size_t first = begin; first < end; first += kBatch) {
      batch.count = std::min(kBatch, end - first);
      propose_batch(moves, weights, first, random, sweep_index, step, batch);
      for (std::size_t i = 0; i < batch.count; ++i) {
        if (!metropolis_accepts(batch.delta[i], temperature, batch.word[i])) continue;
        moves[i].apply(field_);
        ++accepted;
      }
    }
    return accepted;
  });
}

}  // namespace crease
