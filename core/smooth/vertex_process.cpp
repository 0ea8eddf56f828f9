#include "core/smooth/vertex_process.h"

#include <algorithm>
#include <array>

#include "core/smooth/lanes.h"
#include "core/smooth/potential.h"

namespace crease {
namespace {

/// From `origin` to `point`, rounded after the subtraction.
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

}  // namespace

/// A proposal for one vertex. Reused from visit to visit.
class VertexProcess::Visit {
 public:
  explicit Visit(const Rings& rings) : moved_(rings.longest) {}

  /// E with the vertex of `slot` moved by `displacement` minus E now.
  double delta_energy(const VertexProcess& process, std::size_t slot, const Vec3& displacement);
  /// Makes the move of the last delta_energy().
  void accept(VertexProcess& process) const;

 private:
  double curvature_change(const VertexProcess& process);
  /// Calls `visit(face, normal after the move)` for the faces of the ring.
  template <typename Visitor>
  void for_each_face(const VertexProcess& process, Visitor visit) const;
  template <Smoothness kShape>
  Lanes prior_change(const VertexProcess& process, const LaneVectors& displacement);

  std::size_t slot_ = 0;
  Vec3 position_ = Vec3::Zero();    ///< after the move
  std::vector<LaneVectors> moved_;  ///< normals after the move, per block of the ring
  SecondDifference::Moved moved_faces_;
};

double VertexProcess::Visit::delta_energy(const VertexProcess& process, std::size_t slot, const Vec3& displacement) {
  slot_ = slot;
  const Index vertex = process.schedule_.sites[slot];
  const Field& field = process.field_;
  const EnergyModel& model = process.model_;
  position_ = field.positions[vertex] + displacement;
  const LaneVectors everywhere = in_every_lane(displacement);
  const Lanes prior = with_shape(model.smoothness, [&]<Smoothness kShape>() [[gnu::always_inline]] {
    return prior_change<kShape>(process, everywhere);
  });
  double change = model.smoothness_weight * static_cast<double>(sum(prior)) +
                  model.likelihood_weight * field.likelihood.change(field, vertex, position_);
  if (model.curvature_weight > 0) change += model.curvature_weight * curvature_change(process);
  if (process.ridge_straightness_) {
    change += model.ridge_line_weight * process.ridge_straightness_->change(field, vertex, position_);
  }
  return change;
}

double VertexProcess::Visit::curvature_change(const VertexProcess& process) {
  moved_faces_.clear();
  for_each_face(process, [&](Index face, const UnitNormal& normal) { moved_faces_.emplace_back(face, normal); });
  return process.field_.second_difference.change(process.field_, moved_faces_);
}

template <Smoothness kShape>
Lanes VertexProcess::Visit::prior_change(const VertexProcess& process, const LaneVectors& displacement) {
  const auto potential = [&](const LaneVectors& difference) {
    return smoothness_potential<kShape>(difference.squared_norm(), process.model_.smoothness_width);
  };
  const Field& field = process.field_;
  const Vec3 vertex = field.positions[process.schedule_.sites[slot_]];
  const auto weights = [&](const std::array<Index, Rings::kLanes>& edges) {
    Lanes result;
    for (std::size_t k = 0; k < Rings::kLanes; ++k) result[k] = process.smoothing_[edges[k]];
    return result;
  };
  const auto stored_normals = [&](const std::array<Index, Rings::kLanes>& faces) {
    return transposed([&](std::size_t k) { return load(field.normals[faces[k]].data()); });
  };
  Lanes change{};
  LaneVectors* moved_block = moved_.data();
  for (const Rings::Block& block : process.rings_[slot_]) {
    const LaneVectors spokes =
        transposed([&](std::size_t k) { return from(vertex, field.positions[block.points[k]]); }) - displacement;
    const LaneVectors moved = unit_normals(spokes, shifted_down(spokes));
    // Member by member: a copy of the whole goes through other registers.
    moved_block->x = moved.x;
    moved_block->y = moved.y;
    moved_block->z = moved.z;
    ++moved_block;
    const LaneVectors normals = stored_normals(block.faces), outer = stored_normals(block.outer_faces);
    change +=
        weights(block.rim_edges) * (potential(moved - outer) - potential(normals - outer)) +
        weights(block.spoke_edges) * (potential(moved - shifted_up(moved)) - potential(normals - shifted_up(normals)));
  }
  return change;
}

template <typename Visitor>
void VertexProcess::Visit::for_each_face(const VertexProcess& process, Visitor visit) const {
  const LaneVectors* moved = moved_.data();
  for (const Rings::Block& block : process.rings_[slot_]) {
    for (std::size_t lane = 1; lane <= block.face_count; ++lane) {
      visit(block.faces[lane], {moved->x[lane], moved->y[lane], moved->z[lane], 0});
    }
    ++moved;
  }
}

void VertexProcess::Visit::accept(VertexProcess& process) const {
  Field& field = process.field_;
  field.positions[process.schedule_.sites[slot_]] = position_;
  for_each_face(process, [&](Index face, const UnitNormal& normal) { field.normals[face] = normal; });
}

VertexProcess::VertexProcess(Field& field, const Schedule& schedule, std::size_t threads)
    : field_(field),
      schedule_(schedule),
      rings_(field, schedule),
      smoothing_(field.labels.size() + 1, 0),
      visits_(threads * kBatch, Visit(rings_)) {}

VertexProcess::~VertexProcess() = default;

void VertexProcess::set_model(const EnergyModel& model, ThreadTeam& team) {
  constexpr std::size_t kChunk = 8192;
  model_ = model;
  team.run(field_.labels.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t e = begin; e < end; ++e) smoothing_[e] = static_cast<float>(1 - field_.labels[e]);
  });
  ridge_straightness_.reset();
  if (model.ridge_line_weight > 0) ridge_straightness_.emplace(field_, team);
}

double VertexProcess::delta_energy(std::size_t slot, const Vec3& position) {
  return visits_[0].delta_energy(*this, slot, position - field_.positions[schedule_.sites[slot]]);
}

CREASE_WIDE_CLONES void VertexProcess::propose_batch(std::span<Visit, kBatch> visits, std::size_t first,
                                                     const CounterRandom& random, std::uint32_t sweep_index,
                                                     double step, Batch& batch) const {
  std::array<Index, kBatch> sites{};
  std::copy_n(&schedule_.sites[first], batch.count, sites.begin());
  const auto words = random(sweep_index, sites);
  std::array<std::array<double, kBatch>, 3> displacement;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < kBatch; ++i) displacement[axis][i] = step * CounterRandom::symmetric(words[axis][i]);
  }
  batch.word = words[3];
  for (std::size_t i = 0; i < batch.count; ++i) {
    batch.delta[i] =
        visits[i].delta_energy(*this, first + i, {displacement[0][i], displacement[1][i], displacement[2][i]});
  }
}

ProposalCount VertexProcess::sweep(const CounterRandom& random, std::uint32_t sweep_index, double temperature,
                                   double step, ThreadTeam& team) {
  return metropolis_sweep(schedule_, team, [&](std::size_t begin, std::size_t end, std::size_t thread) {
    const std::span<Visit, kBatch> visits(visits_.data() + thread * kBatch, kBatch);
    Batch batch;
    std::uint64_t accepted = 0;
    for (std::size_t first = begin; first < end; first += kBatch) {
      batch.count = std::min(kBatch, end - first);
      propose_batch(visits, first, random, sweep_index, step, batch);
      for (std::size_t i = 0; i < batch.count; ++i) {
        if (!metropolis_accepts(batch.delta[i], temperature, batch.word[i])) continue;
        visits[i].accept(*this);
        ++accepted;
      }
    }
    return accepted;
  });
}

}  // namespace crease
