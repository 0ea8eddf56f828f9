#include "core/solve/face_process.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "core/energy/smoothness.h"
#include "core/geometry/vertex_fans.h"

namespace crease {
namespace {

constexpr std::size_t kFarthest = 3;  ///< faces apart round a vertex

/// A direction uniform on the sphere, 0 in the fourth place.
UnitNormal random_direction(std::uint32_t height, std::uint32_t turn) {
  const double z = CounterRandom::symmetric(height);
  const double angle = 2 * std::numbers::pi * CounterRandom::unit(turn);
  const double radius = std::sqrt(1 - z * z);
  return {static_cast<float>(radius * std::cos(angle)), static_cast<float>(radius * std::sin(angle)),
          static_cast<float>(z), 0};
}

}  // namespace

FaceProcess::FaceProcess(Field& field, const EnergyTerms& terms, double normal_weight, double corner_weight)
    : field_(field),
      smoothness_(terms.get<SmoothnessTerm>()),
      smoothness_weight_(terms.final_weights().of<SmoothnessTerm>()),
      normal_weight_(normal_weight),
      corner_weight_(corner_weight),
      starts_(field.faces.size() + 1, 0) {
  if (corner_weight_ > 0) find_corner_pairs();
}

void FaceProcess::find_corner_pairs() {
  VertexFans fans(field_);
  std::vector<Index> crossed;  // between face k and the next of the fan
  for (Index vertex = 0; vertex < field_.positions.size(); ++vertex) {
    fans.visit(vertex, [&](std::span<const Corner> fan, bool closed) {
      const std::size_t n = fan.size();
      const auto add = [&](std::size_t i, std::size_t apart) {
        Pair pair{fan[i].face, fan[(i + apart) % n].face, {kNone, kNone, kNone}, {kNone, kNone, kNone, kNone}};
        for (std::size_t k = 0; k < apart; ++k) pair.way[k] = fan[(i + k) % n].edge_c;
        const std::size_t around = n - apart;
        if (closed && around <= pair.other.size()) {
          for (std::size_t k = 0; k < around; ++k) pair.other[k] = fan[(i + apart + k) % n].edge_c;
        }
        pairs_.push_back(pair);
      };
      for (std::size_t apart = 2; apart <= kFarthest; ++apart) {
        const std::size_t count = !closed          ? (n > apart ? n - apart : 0)
                                  : 2 * apart < n  ? n
                                  : 2 * apart == n ? apart
                                                   : 0;
        for (std::size_t i = 0; i < count; ++i) add(i, apart);
      }
    });
  }
  pair_weights_.resize(pairs_.size());
  for (const Pair& pair : pairs_) {
    ++starts_[pair.face0 + 1];
    ++starts_[pair.face1 + 1];
  }
  for (std::size_t f = 1; f < starts_.size(); ++f) starts_[f] += starts_[f - 1];
  neighbors_.resize(starts_.back());
  std::vector<std::size_t> next(starts_.begin(), starts_.end() - 1);
  for (Index p = 0; p < pairs_.size(); ++p) {
    neighbors_[next[pairs_[p].face0]++] = {pairs_[p].face1, p};
    neighbors_[next[pairs_[p].face1]++] = {pairs_[p].face0, p};
  }
}

void FaceProcess::measure(ThreadTeam& team) {
  measured_ = field_.normals;
  areas_.resize(field_.faces.size());
  const auto area = [&](std::size_t f) { return field_.area_vector(f).norm(); };
  const double mean = block_sum<double>(areas_.size(), team, area) / static_cast<double>(areas_.size());
  team.run(areas_.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t f = begin; f < end; ++f) areas_[f] = mean > 0 ? static_cast<float>(area(f) / mean) : 1;
  });
}

void FaceProcess::exchange(StateArchive& archive) {
  archive.values(measured_);
  archive.values(areas_);
}

void FaceProcess::labels_changed(ThreadTeam& team) {
  const auto gate = [&](const auto& way) {
    float product = way[0] != kNone ? 1.0F : 0.0F;
    for (const Index edge : way) product *= edge != kNone ? smoothness_.kept()[edge] : 1.0F;
    return product;
  };
  team.run(pairs_.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t p = begin; p < end; ++p) {
      pair_weights_[p] = static_cast<float>(corner_weight_) * std::max(gate(pairs_[p].way), gate(pairs_[p].other));
    }
  });
}

/// Calls `visit(face, weight)` for everything that the prior couples with `face`.
template <typename Visit>
void FaceProcess::visit_neighbors(Index face, Visit visit) const {
  for (const Index edge : field_.topology.face_edges[face]) {
    if (edge == kNone || smoothness_.kept()[edge] == 0) continue;
    visit(other_face(field_.topology.edge_faces[edge], face), smoothness_.kept()[edge]);
  }
  for (std::size_t k = starts_[face]; k < starts_[face + 1]; ++k) {
    visit(neighbors_[k].face, pair_weights_[neighbors_[k].pair]);
  }
}

double FaceProcess::likelihood(ThreadTeam& team) const {
  return normal_weight_ * block_sum<double>(measured_.size(), team, [&](std::size_t f) {
           return static_cast<double>(areas_[f] * (field_.normals[f] - measured_[f]).squaredNorm());
         });
}

double FaceProcess::smoothness(ThreadTeam& team) const {
  // Every pair is met from both of its faces.
  return smoothness_weight_ / 2 * block_sum<double>(measured_.size(), team, [&](std::size_t f) {
           double sum = 0;
           visit_neighbors(static_cast<Index>(f), [&](Index other, float weight) {
             sum += static_cast<double>(weight) * rho(field_.normals[f] - field_.normals[other]);
           });
           return sum;
         });
}

double FaceProcess::delta_energy(Index face, const UnitNormal& normal) const {
  const UnitNormal& now = field_.normals[face];
  double prior = 0;
  visit_neighbors(face, [&](Index other, float weight) {
    const UnitNormal& beside = field_.normals[other];
    prior += static_cast<double>(weight) * (rho(normal - beside) - rho(now - beside));
  });
  const float moved = (normal - measured_[face]).squaredNorm() - (now - measured_[face]).squaredNorm();
  return smoothness_weight_ * prior + normal_weight_ * static_cast<double>(areas_[face] * moved);
}

ProposalCount FaceProcess::sweep(const Schedule& schedule, const CounterRandom& random, std::uint32_t sweep_index,
                                 double temperature, double step, ThreadTeam& team) {
  return metropolis_sweep(schedule, team, [&](std::size_t begin, std::size_t end, std::size_t) {
    std::uint64_t accepted = 0;
    for (std::size_t slot = begin; slot < end; ++slot) {
      const Index face = schedule.sites[slot];
      const CounterRandom::Words words = random(sweep_index, face);
      const auto length = static_cast<float>(step * CounterRandom::unit(words[2]));
      const UnitNormal proposed = (field_.normals[face] + length * random_direction(words[0], words[1])).normalized();
      if (!metropolis_accepts(delta_energy(face, proposed), temperature, words[3])) continue;
      field_.normals[face] = proposed;
      ++accepted;
    }
    return accepted;
  });
}

}  // namespace crease
