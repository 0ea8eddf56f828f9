#include "core/smooth/vertex_process.h"

#include <algorithm>
#include <cmath>

namespace crease {
namespace {

/// Rows of VertexVisit::lanes_.
enum Row : std::size_t {
  kBx,
  kBy,
  kBz,
  kCx,
  kCy,
  kCz,
  kOuterX,
  kOuterY,
  kOuterZ,
  kOuterSquare,
  kWeight,
  kNx,
  kNy,
  kNz,
  kRows
};

Index rim_of(const Topology& topology, Index face, Index b, Index c) {
  for (const Index edge : topology.face_edges[face]) {
    if (edge == kNone) continue;
    const Edge& candidate = topology.edges[edge];
    if (candidate == Edge{std::min(b, c), std::max(b, c)}) return edge;
  }
  return kNone;
}

Rings::Face ring_face(const Field& field, Index face, Index vertex) {
  const Triangle& corners = field.faces[face];
  const auto k = static_cast<std::size_t>(std::ranges::find(corners, vertex) - corners.begin());
  Rings::Face result{corners[(k + 1) % 3], corners[(k + 2) % 3], face, kNone, kNone};
  const Index rim = rim_of(field.topology, face, result.b, result.c);
  if (rim != kNone && field.topology.is_interior(rim)) {
    const auto [f0, f1] = field.topology.edge_faces[rim];
    result.rim_edge = rim;
    result.outer_face = f0 == face ? f1 : f0;
  }
  return result;
}

}  // namespace

Rings::Rings(const Field& field) {
  const Topology& topology = field.topology;
  const std::size_t vertex_count = field.positions.size();
  face_starts.assign(1, 0);
  spoke_starts.assign(1, 0);
  std::vector<std::uint32_t> place(field.faces.size(), 0);  // of a face in the ring at hand
  for (Index vertex = 0; vertex < vertex_count; ++vertex) {
    const auto ring = topology.vertex_faces[vertex];
    for (std::uint32_t i = 0; i < ring.size(); ++i) {
      place[ring[i]] = i;
      faces.push_back(ring_face(field, ring[i], vertex));
    }
    for (const Index edge : topology.vertex_edges[vertex]) {
      if (!topology.is_interior(edge)) continue;
      const auto [f0, f1] = topology.edge_faces[edge];
      spokes.push_back({edge, place[f0], place[f1]});
    }
    face_starts.push_back(faces.size());
    spoke_starts.push_back(spokes.size());
    largest = std::max(largest, ring.size());
  }
}

VertexVisit::VertexVisit(const Rings& rings) : stride_((rings.largest + 3) / 4 * 4), lanes_(kRows * stride_) {}

void VertexVisit::load(const Field& field, const Rings& rings, const EnergyModel& model, Index vertex) {
  vertex_ = vertex;
  measured_ = field.measured[vertex];
  old_position_ = field.positions[vertex];
  const std::size_t begin = rings.face_starts[vertex];
  face_count_ = rings.face_starts[vertex + 1] - begin;
  double* lanes = lanes_.data();
  for (std::size_t k = 0; k < face_count_; ++k) {
    const Rings::Face& ring = rings.faces[begin + k];
    const auto put = [&](Row row, const Vec3& value) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        lanes[(row + axis) * stride_ + k] = value[static_cast<Eigen::Index>(axis)];
      }
    };
    put(kBx, field.positions[ring.b]);
    put(kCx, field.positions[ring.c]);
    put(kNx, field.normals[ring.face]);
    const bool has_outer = ring.outer_face != kNone;
    const Vec3 outer = has_outer ? field.normals[ring.outer_face] : Vec3::Zero();
    put(kOuterX, outer);
    lanes[kOuterSquare * stride_ + k] = outer.squaredNorm();
    lanes[kWeight * stride_ + k] = has_outer ? 1 - field.labels[ring.rim_edge] : 0;
  }
  spokes_.clear();
  for (std::size_t s = rings.spoke_starts[vertex]; s < rings.spoke_starts[vertex + 1]; ++s) {
    const Rings::Spoke& spoke = rings.spokes[s];
    spokes_.push_back({1 - field.labels[spoke.edge], spoke.first, spoke.second});
  }
  old_prior_ = prior_energy(model);
}

double VertexVisit::delta_energy(const EnergyModel& model, const Vec3& position) {
  new_position_ = position;
  turn_faces(position);
  return model.smoothness_weight * (prior_energy(model) - old_prior_) +
         model.likelihood_weight * ((position - measured_).squaredNorm() - (old_position_ - measured_).squaredNorm());
}

void VertexVisit::turn_faces(const Vec3& position) {
  const double x = position.x(), y = position.y(), z = position.z();
  double* const lanes = lanes_.data();
  const double* const bx = lanes + kBx * stride_;
  const double* const by = lanes + kBy * stride_;
  const double* const bz = lanes + kBz * stride_;
  const double* const cx = lanes + kCx * stride_;
  const double* const cy = lanes + kCy * stride_;
  const double* const cz = lanes + kCz * stride_;
  double* const nx = lanes + kNx * stride_;
  double* const ny = lanes + kNy * stride_;
  double* const nz = lanes + kNz * stride_;
#pragma GCC ivdep
  for (std::size_t k = 0; k < face_count_; ++k) {
    const double ux = bx[k] - x, uy = by[k] - y, uz = bz[k] - z;
    const double vx = cx[k] - x, vy = cy[k] - y, vz = cz[k] - z;
    const double px = uy * vz - uz * vy, py = uz * vx - ux * vz, pz = ux * vy - uy * vx;
    const double length = std::sqrt(px * px + py * py + pz * pz);
    const double scale = length > 0 ? 1 / length : 0;
    nx[k] = px * scale;
    ny[k] = py * scale;
    nz[k] = pz * scale;
  }
}

double VertexVisit::prior_energy(const EnergyModel& model) const {
  return model.smoothness == Smoothness::kQuadratic ? quadratic_energy() : square_root_energy();
}

double VertexVisit::quadratic_energy() const {
  const double* const lanes = lanes_.data();
  const auto at = [&](Row row, std::size_t k) { return lanes[row * stride_ + k]; };
  double sum = 0;
  for (std::size_t k = 0; k < face_count_; ++k) {
    const double dx = at(kNx, k) - at(kOuterX, k), dy = at(kNy, k) - at(kOuterY, k), dz = at(kNz, k) - at(kOuterZ, k);
    sum += at(kWeight, k) * (dx * dx + dy * dy + dz * dz);
  }
  for (const Spoke& spoke : spokes_) {
    const double dx = at(kNx, spoke.first) - at(kNx, spoke.second);
    const double dy = at(kNy, spoke.first) - at(kNy, spoke.second);
    const double dz = at(kNz, spoke.first) - at(kNz, spoke.second);
    sum += spoke.weight * (dx * dx + dy * dy + dz * dz);
  }
  return sum;
}

double VertexVisit::square_root_energy() const {
  const double* const lanes = lanes_.data();
  const auto at = [&](Row row, std::size_t k) { return lanes[row * stride_ + k]; };
  double sum = 0;
  for (std::size_t k = 0; k < face_count_; ++k) {
    const double dx = at(kNx, k) - at(kOuterX, k), dy = at(kNy, k) - at(kOuterY, k), dz = at(kNz, k) - at(kOuterZ, k);
    sum += at(kWeight, k) * std::sqrt(dx * dx + dy * dy + dz * dz);
  }
  for (const Spoke& spoke : spokes_) {
    const double dx = at(kNx, spoke.first) - at(kNx, spoke.second);
    const double dy = at(kNy, spoke.first) - at(kNy, spoke.second);
    const double dz = at(kNz, spoke.first) - at(kNz, spoke.second);
    sum += spoke.weight * std::sqrt(dx * dx + dy * dy + dz * dz);
  }
  return sum;
}

void VertexVisit::accept(Field& field, const Rings& rings) const {
  field.positions[vertex_] = new_position_;
  const std::size_t begin = rings.face_starts[vertex_];
  const double* const lanes = lanes_.data();
  for (std::size_t k = 0; k < face_count_; ++k) {
    field.normals[rings.faces[begin + k].face] = {lanes[kNx * stride_ + k], lanes[kNy * stride_ + k],
                                                  lanes[kNz * stride_ + k]};
  }
}

VertexProcess::VertexProcess(Field& field, std::size_t threads)
    : field_(field), rings_(field), visits_(threads, VertexVisit(rings_)) {}

double VertexProcess::delta_energy(const EnergyModel& model, Index vertex, const Vec3& position) {
  visits_[0].load(field_, rings_, model, vertex);
  return visits_[0].delta_energy(model, position);
}

ProposalCount VertexProcess::sweep(const EnergyModel& model, const Coloring& coloring, const CounterRandom& random,
                                   std::uint32_t sweep_index, double temperature, double step, ThreadTeam& team) {
  return metropolis_sweep(coloring, team, [&](Index vertex, std::size_t thread) {
    const CounterRandom::Words words = random(sweep_index, vertex);
    const Vec3 displacement(CounterRandom::symmetric(words[0]), CounterRandom::symmetric(words[1]),
                            CounterRandom::symmetric(words[2]));
    VertexVisit& visit = visits_[thread];
    visit.load(field_, rings_, model, vertex);
    const double delta = visit.delta_energy(model, field_.positions[vertex] + step * displacement);
    if (!metropolis_accepts(delta, temperature, words[3])) return false;
    visit.accept(field_, rings_);
    return true;
  });
}

}  // namespace crease
