#include "core/smooth/vertex_process.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace crease {
namespace {

/// Lanes are worked on this many at a time, so that the compiler can keep them in vector registers; a ring of up to six
/// faces is one block.
constexpr std::size_t kBlock = 8;

/// Sites of a group are independent, so this many proposals are computed before the first is decided: a decision is a
/// coin toss that no processor predicts, and waiting for each would leave it idle.
constexpr std::size_t kBatch = 8;

}  // namespace

/// One vertex lifted out of the field, with everything that E says of its position. Reused from visit to visit.
class VertexProcess::Visit {
 public:
  explicit Visit(const Rings& rings)
      : stride_((rings.longest / kBlock + 2) * kBlock), storage_(kRows * stride_ + 2 * kBlock, 0.0) {}

  void load(const VertexProcess& process, std::size_t slot);
  double delta_energy(const EnergyModel& model, const Vec3& position);
  /// Moves the vertex to the position of the last delta_energy().
  void accept(Field& field) const;
  const Vec3& position() const { return old_position_; }

 private:
  enum RowName : std::size_t {
    kPoint = 0,  // x, y, z of the ring's points
    kOuter = 3,  // normals beyond the rim
    kOld = 6,    // normals of the ring's faces
    kNew = 9,    // the same after the move
    kRimWeight = 12,
    kSpokeWeight = 13,
    kRows = 14
  };

  double* row(std::size_t name) { return storage_.data() + kBlock + name * stride_; }
  const double* row(std::size_t name) const { return storage_.data() + kBlock + name * stride_; }
  void put(std::size_t name, std::size_t lane, const Vec3& value) {
    for (std::size_t axis = 0; axis < 3; ++axis) row(name + axis)[lane] = value[static_cast<Eigen::Index>(axis)];
  }
  void turn_faces(const Vec3& position);
  template <Smoothness kShape>
  double prior_energy(RowName normals) const;
  double prior_energy(RowName normals, Smoothness shape) const {
    return shape == Smoothness::kQuadratic ? prior_energy<Smoothness::kQuadratic>(normals)
                                           : prior_energy<Smoothness::kSquareRoot>(normals);
  }

  Index vertex_ = kNone;
  std::span<const Rings::Lane> lanes_;
  std::size_t blocks_ = 0;
  Vec3 measured_ = Vec3::Zero(), old_position_ = Vec3::Zero(), new_position_ = Vec3::Zero();
  std::size_t stride_;
  std::vector<double> storage_;  ///< rows of lanes; each row has a spare block behind it
};

void VertexProcess::Visit::load(const VertexProcess& process, std::size_t slot) {
  const Field& field = process.field_;
  vertex_ = process.schedule_.sites[slot];
  measured_ = field.measured[vertex_];
  old_position_ = field.positions[vertex_];
  lanes_ = process.rings_[slot];
  blocks_ = (lanes_.size() + kBlock - 1) / kBlock;
  double* const rim = row(kRimWeight);
  double* const spoke = row(kSpokeWeight);
  std::size_t k = 0;
  for (const Rings::Lane& lane : lanes_) {
    put(kPoint, k, field.positions[lane.point]);
    put(kOuter, k, field.normals[lane.outer_face]);
    put(kOld, k, lane.face != kNone ? field.normals[lane.face] : Vec3::Zero());
    rim[k] = process.smoothing_[lane.rim_edge];
    spoke[k] = process.smoothing_[lane.spoke_edge];
    ++k;
  }
  for (; k < blocks_ * kBlock; ++k) rim[k] = spoke[k] = 0;
}

double VertexProcess::Visit::delta_energy(const EnergyModel& model, const Vec3& position) {
  new_position_ = position;
  turn_faces(position);
  const double prior = prior_energy(kNew, model.smoothness) - prior_energy(kOld, model.smoothness);
  const double likelihood = (position - measured_).squaredNorm() - (old_position_ - measured_).squaredNorm();
  return model.smoothness_weight * prior + model.likelihood_weight * likelihood;
}

void VertexProcess::Visit::turn_faces(const Vec3& position) {
  const double x = position.x(), y = position.y(), z = position.z();
  for (std::size_t block = 0; block < blocks_ * kBlock; block += kBlock) {
    const double* const px = row(kPoint) + block;
    const double* const py = row(kPoint + 1) + block;
    const double* const pz = row(kPoint + 2) + block;
    double* const nx = row(kNew) + block;
    double* const ny = row(kNew + 1) + block;
    double* const nz = row(kNew + 2) + block;
#pragma GCC ivdep
    for (std::size_t j = 0; j < kBlock; ++j) {
      const double bx = px[j] - x, by = py[j] - y, bz = pz[j] - z;
      const double cx = px[j + 1] - x, cy = py[j + 1] - y, cz = pz[j + 1] - z;
      const double ox = by * cz - bz * cy, oy = bz * cx - bx * cz, oz = bx * cy - by * cx;
      const double square = ox * ox + oy * oy + oz * oz;
      const double scale = 1 / std::sqrt(square + kNoArea);
      nx[j] = ox * scale;
      ny[j] = oy * scale;
      nz[j] = oz * scale;
    }
  }
}

template <Smoothness kShape>
double VertexProcess::Visit::prior_energy(RowName normals) const {
  double sums[kBlock] = {};
  for (std::size_t block = 0; block < blocks_ * kBlock; block += kBlock) {
    const double* const nx = row(normals) + block;
    const double* const ny = row(normals + std::size_t{1}) + block;
    const double* const nz = row(normals + std::size_t{2}) + block;
    const double* const ox = row(kOuter) + block;
    const double* const oy = row(kOuter + 1) + block;
    const double* const oz = row(kOuter + 2) + block;
    const double* const rim = row(kRimWeight) + block;
    const double* const spoke = row(kSpokeWeight) + block;
#pragma GCC ivdep
    for (std::size_t j = 0; j < kBlock; ++j) {
      const double rx = nx[j] - ox[j], ry = ny[j] - oy[j], rz = nz[j] - oz[j];
      const double sx = nx[j] - (nx - 1)[j], sy = ny[j] - (ny - 1)[j], sz = nz[j] - (nz - 1)[j];
      sums[j] += rim[j] * smoothness_potential(kShape, rx * rx + ry * ry + rz * rz) +
                 spoke[j] * smoothness_potential(kShape, sx * sx + sy * sy + sz * sz);
    }
  }
  return ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
}

void VertexProcess::Visit::accept(Field& field) const {
  field.positions[vertex_] = new_position_;
  for (std::size_t k = 0; k < lanes_.size(); ++k) {
    if (lanes_[k].face != kNone) field.normals[lanes_[k].face] = {row(kNew)[k], row(kNew + 1)[k], row(kNew + 2)[k]};
  }
}

VertexProcess::VertexProcess(Field& field, const Schedule& schedule, std::size_t threads)
    : field_(field), schedule_(schedule), rings_(field, schedule), visits_(threads * kBatch, Visit(rings_)) {}

VertexProcess::~VertexProcess() = default;

void VertexProcess::set_model(const EnergyModel& model) {
  model_ = model;
  smoothing_.resize(field_.topology.edges.size() + 1);
  for (std::size_t e = 0; e < field_.topology.edges.size(); ++e) {
    smoothing_[e] = field_.topology.is_interior(e) ? 1 - field_.labels[e] : 0;
  }
  smoothing_.back() = 0;
}

double VertexProcess::delta_energy(std::size_t slot, const Vec3& position) {
  visits_[0].load(*this, slot);
  return visits_[0].delta_energy(model_, position);
}

double VertexProcess::propose(Visit& visit, std::size_t slot, const CounterRandom::Words& words, double step) const {
  const Vec3 displacement(CounterRandom::symmetric(words[0]), CounterRandom::symmetric(words[1]),
                          CounterRandom::symmetric(words[2]));
  visit.load(*this, slot);
  return visit.delta_energy(model_, visit.position() + step * displacement);
}

ProposalCount VertexProcess::sweep(const CounterRandom& random, std::uint32_t sweep_index, double temperature,
                                   double step, ThreadTeam& team) {
  return metropolis_sweep(schedule_, team, [&](std::size_t begin, std::size_t end, std::size_t thread) {
    Visit* const visits = visits_.data() + thread * kBatch;
    std::array<double, kBatch> delta{};
    std::array<std::uint32_t, kBatch> word{};
    std::uint64_t accepted = 0;
    for (std::size_t first = begin; first < end; first += kBatch) {
      const std::size_t count = std::min(kBatch, end - first);
      for (std::size_t i = 0; i < count; ++i) {
        const CounterRandom::Words words = random(sweep_index, schedule_.sites[first + i]);
        delta[i] = propose(visits[i], first + i, words, step);
        word[i] = words[3];
      }
      for (std::size_t i = 0; i < count; ++i) {
        if (!metropolis_accepts(delta[i], temperature, word[i])) continue;
        visits[i].accept(field_);
        ++accepted;
      }
    }
    return accepted;
  });
}

}  // namespace crease
