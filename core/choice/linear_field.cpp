#include "core/choice/linear_field.h"

#include <algorithm>
#include <cmath>

#include "core/base/random.h"

namespace crease {
namespace {

constexpr float kLeastPrecision = 1e-3F;  ///< of vertices whose measured positions count for nothing
constexpr int kMostSteps = 400;
constexpr float kTolerance = 0.01F;  ///< of the residual in the metric of the diagonal, relative

/// Second derivative of the potential with respect to the turn of a normal, over its slope: 1 while the turn is far
/// below the scale, and 0 where the potential is no longer convex. `z` is the squared turn in squared scales.
float convexity(float exponent, float z) {
  const float b = 2 - exponent;
  if (!(b > 0)) return 1;
  const float u = 1 + z / b;
  return std::max(0.0F, (u - z) / u);
}

Vec3 vec3_at(std::span<const float> flat, FlatIndex i) {
  const auto p = vector_at(flat, static_cast<std::size_t>(i));
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

/// ±1 in each lane, from the lowest bits.
Samples signs_of(std::uint32_t bits) {
  Samples signs;
  for (std::size_t k = 0; k < Samples::kCount; ++k) signs.lanes[k] = ((bits >> k) & 1U) != 0 ? 1.0F : -1.0F;
  return signs;
}

/// Random signs for each place of some fields.
struct SignFields {
  CounterRandom random;
  std::uint32_t number;

  Samples operator()(std::uint32_t field, std::size_t i) const {
    return signs_of(random(number, static_cast<std::uint32_t>(i), field)[0]);
  }
};

CREASE_WIDE_CLONES void turn_hinges(const std::array<FlatIndex, 4>* hinges, const std::array<float, 4>* stencils,
                                    const Samples* fields, Samples* turns, std::size_t begin, std::size_t end) {
  for (std::size_t e = begin; e < end; ++e) {
    Lanes sum{};
    for (std::size_t k = 0; k < 4; ++k) sum += stencils[e][k] * fields[hinges[e][k]].lanes;
    turns[e].lanes = sum;
  }
}

CREASE_WIDE_CLONES void add_turns_of(const IndexRows& rows, const float* coefficients, const Samples* turns,
                                     Samples* sums, std::size_t begin, std::size_t end) {
  for (std::size_t v = begin; v < end; ++v) {
    Lanes sum = sums[v].lanes;
    for (Index i = rows.starts[v]; i < rows.starts[v + 1]; ++i) sum += coefficients[i] * turns[rows.items[i]].lanes;
    sums[v].lanes = sum;
  }
}

struct Total {
  std::array<double, Samples::kCount> values{};
  Total& operator+=(const Total& other) {
    for (std::size_t k = 0; k < values.size(); ++k) values[k] += other.values[k];
    return *this;
  }
};

}  // namespace

LinearField::LinearField(const FlatMesh& mesh, const FlatVectors& positions, const GraduatedOptions& options,
                         std::span<const float> precisions, ThreadTeam& team)
    : mesh_(mesh), team_(team), turns_(mesh.edge_count) {
  GraduatedOptions last_stage = options;
  last_stage.steps = 0;
  last_stage.metric = nullptr;
  GraduatedDescent descent(mesh, mesh.measured, last_stage, precisions, {}, team);
  descent.resume(options.stages - 1, positions);
  descent.run([&](const StageView& view) {
    linearize(view.energy, positions);
    return true;
  });
  gather_coefficients();
}

void LinearField::linearize(const GraduatedEnergy& energy, std::span<const float> positions) {
  normals_ = energy.vertex_normals;
  precisions_ = energy.precisions;
  for (float& precision : precisions_) precision = std::max(precision, kLeastPrecision);
  const std::vector<float> angles = dihedral_angles(mesh_, positions, team_);
  const std::vector<float> stiffness = energy.stiffness(positions);
  hinges_.resize(mesh_.edge_count);
  stencils_.resize(mesh_.edge_count);
  for (std::size_t e = 0; e < mesh_.edge_count; ++e) {
    hinges_[e] = {mesh_.edge_opposites[0][e], mesh_.edge_opposites[1][e], mesh_.edge_ends[0][e], mesh_.edge_ends[1][e]};
    stencils_[e] = stencil_of(positions, hinges_[e], energy.fading_area);
    const float turn = 2 * std::sin(angles[e] / 2) / energy.edge_scale(e);
    const float curvature = stiffness[e] * convexity(energy.exponent, turn * turn);
    const float scale = std::sqrt(curvature / (2 * energy.likelihood));
    for (float& value : stencils_[e]) value = std::isfinite(value * scale) ? value * scale : 0;
  }
}

/// How far the faces turn against each other as the vertices of a hinge move along their normals.
LinearField::Stencil LinearField::stencil_of(std::span<const float> positions, const Hinge& hinge,
                                             float fading_area) const {
  constexpr double kLeastSquare = 1e-3, kLeastFading = 1e-4;
  const double fading = std::max(kLeastFading, static_cast<double>(fading_area));
  const Vec3 origin = vec3_at(positions, hinge[2]), along = vec3_at(positions, hinge[3]) - origin;
  const double square = std::max(kLeastSquare, along.squaredNorm());
  std::array<double, 4> turn{};
  for (std::size_t side = 0; side < 2; ++side) {
    const Vec3 corner = vec3_at(positions, hinge[side]) - origin, area = along.cross(corner);
    const double length = std::sqrt(area.squaredNorm() + fading * fading), height = std::sqrt(square) / length;
    const double foot = std::clamp(corner.dot(along) / square, -1.0, 2.0);
    const auto add = [&](std::size_t k, double share) {
      turn[k] += share * height * std::abs(area.dot(vec3_at(normals_, hinge[k]))) / length;
    };
    add(side, 1);
    add(2, foot - 1);
    add(3, -foot);
  }
  return {static_cast<float>(turn[0]), static_cast<float>(turn[1]), static_cast<float>(turn[2]),
          static_cast<float>(turn[3])};
}

void LinearField::gather_coefficients() {
  const IndexRows& rows = mesh_.vertex_stencils;
  diagonal_ = precisions_;
  coefficients_.resize(rows.items.size());
  for (std::size_t v = 0; v < mesh_.vertex_count; ++v) {
    for (Index i = rows.starts[v]; i < rows.starts[v + 1]; ++i) {
      const Index e = rows.items[i];
      const auto place = std::ranges::find(hinges_[e], static_cast<FlatIndex>(v));
      coefficients_[i] = stencils_[e][static_cast<std::size_t>(place - hinges_[e].begin())];
      diagonal_[v] += coefficients_[i] * coefficients_[i];
    }
  }
}

template <typename Body>
void LinearField::for_each_vertex(Body body) {
  team_.run(mesh_.vertex_count, kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t v = begin; v < end; ++v) body(v);
  });
}

void LinearField::find_turns(const std::vector<Samples>& fields) {
  team_.run(mesh_.edge_count, kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    turn_hinges(hinges_.data(), stencils_.data(), fields.data(), turns_.data(), begin, end);
  });
}

void LinearField::add_turns(std::vector<Samples>& sums) {
  team_.run(mesh_.vertex_count, kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    add_turns_of(mesh_.vertex_stencils, coefficients_.data(), turns_.data(), sums.data(), begin, end);
  });
}

std::vector<Samples> LinearField::product(const std::vector<Samples>& fields) {
  std::vector<Samples> result(fields.size());
  for_each_vertex([&](std::size_t v) { result[v].lanes = precisions_[v] * fields[v].lanes; });
  find_turns(fields);
  add_turns(result);
  return result;
}

Samples LinearField::dot(const std::vector<Samples>& a, const std::vector<Samples>& b) {
  const Total total = block_sum<Total>(a.size(), team_, [&](std::size_t v) {
    const Lanes product = a[v].lanes * b[v].lanes;
    Total term;
    for (std::size_t k = 0; k < Samples::kCount; ++k) term.values[k] = static_cast<double>(product[k]);
    return term;
  });
  Samples result;
  for (std::size_t k = 0; k < Samples::kCount; ++k) result.lanes[k] = static_cast<float>(total.values[k]);
  return result;
}

std::vector<Samples> LinearField::draw(std::uint32_t seed, std::uint32_t number, const std::function<void()>& on_step) {
  const SignFields signs{CounterRandom(seed, RandomStream::kPosterior), number};
  std::vector<Samples> right(mesh_.vertex_count);
  for_each_vertex([&](std::size_t v) { right[v].lanes = std::sqrt(precisions_[v]) * signs(0, v).lanes; });
  for (std::size_t e = 0; e < turns_.size(); ++e) turns_[e] = signs(1, e);
  add_turns(right);
  return solve(std::move(right), on_step);
}

std::vector<Samples> LinearField::draw_diffused(std::uint32_t seed, std::uint32_t number, int steps,
                                                const std::function<void()>& on_step) {
  const SignFields signs{CounterRandom(seed, RandomStream::kPosterior), number};
  std::vector<Samples> values(mesh_.vertex_count);
  for_each_vertex([&](std::size_t v) { values[v].lanes = signs(0, v).lanes / std::sqrt(precisions_[v]); });
  for (int step = 0; step < steps / 2; ++step) values = response(values, on_step);
  return values;
}

std::vector<Samples> LinearField::response(const std::vector<Samples>& values, const std::function<void()>& on_step) {
  std::vector<Samples> right(values.size());
  for_each_vertex([&](std::size_t v) { right[v].lanes = precisions_[v] * values[v].lanes; });
  return solve(std::move(right), on_step);
}

/// Conjugate gradients, preconditioned by the diagonal, for eight right sides at once.
std::vector<Samples> LinearField::solve(std::vector<Samples> right, const std::function<void()>& on_step) {
  std::vector<Samples> result(right.size()), scaled(right.size()), step(right.size());
  const auto scale = [&] { for_each_vertex([&](std::size_t v) { scaled[v].lanes = right[v].lanes / diagonal_[v]; }); };
  scale();
  step = scaled;
  Samples rest = dot(right, scaled);
  const Samples first = rest;
  for (int number = 0; number < kMostSteps; ++number) {
    on_step();
    const std::vector<Samples> changes = product(step);
    const Samples curvature = dot(step, changes);
    Samples length, turn;
    for (std::size_t k = 0; k < Samples::kCount; ++k) {
      length.lanes[k] = curvature.lanes[k] > 0 ? rest.lanes[k] / curvature.lanes[k] : 0;
    }
    for_each_vertex([&](std::size_t v) {
      result[v].lanes += length.lanes * step[v].lanes;
      right[v].lanes -= length.lanes * changes[v].lanes;
    });
    scale();
    const Samples next = dot(right, scaled);
    bool done = true;
    for (std::size_t k = 0; k < Samples::kCount; ++k) {
      done = done && !(next.lanes[k] > kTolerance * kTolerance * first.lanes[k]);
      turn.lanes[k] = rest.lanes[k] > 0 ? next.lanes[k] / rest.lanes[k] : 0;
    }
    if (done) break;
    for_each_vertex([&](std::size_t v) { step[v].lanes = scaled[v].lanes + turn.lanes * step[v].lanes; });
    rest = next;
  }
  return result;
}

}  // namespace crease
