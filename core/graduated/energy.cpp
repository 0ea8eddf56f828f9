#include "core/graduated/energy.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/graduated/fast_math.h"

namespace crease {
namespace {

/// Sites of a block: its terms fit into the cache, and its sum does not depend on threads.
constexpr std::size_t kBlock = 1024, kLaneBlocks = kBlock / kLaneCount;
using BlockNumbers = std::array<float, kBlock>;

/// Sum in eight lanes, whatever the machine's are.
CREASE_LANES_INLINE float sum_of(const float* terms, std::size_t count) {
  std::array<float, 8> lanes{};
  std::size_t i = 0;
  for (; i + 8 <= count; i += 8) {
    for (std::size_t k = 0; k < 8; ++k) lanes[k] += terms[i + k];
  }
  float sum = ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]));
  for (; i < count; ++i) sum += terms[i];
  return sum;
}

struct Flat {
  const float *x, *y, *z;
};
Flat flat(std::span<const float> vectors) {
  const std::size_t count = vectors.size() / 3;
  return {vectors.data(), vectors.data() + count, vectors.data() + 2 * count};
}

// ψ and 2 ∂ψ/∂q, each times the weight w, of `stiffness` w/c and `sharpness` 1/c², which may not be 0.
struct PotentialValue {
  Lanes term, slope;
};
struct Quadratic {
  CREASE_LANES_INLINE PotentialValue operator()(const Lanes& q, const Lanes& stiffness, const Lanes&) const {
    return {0.5F * stiffness * q, stiffness};
  }
};
struct SquareRoot {
  CREASE_LANES_INLINE PotentialValue operator()(const Lanes& q, const Lanes& stiffness, const Lanes& sharpness) const {
    const Lanes root = sqrt(1 + q * sharpness);
    return {stiffness * q / (root + 1), stiffness / root};
  }
};
struct Logarithm {
  CREASE_LANES_INLINE PotentialValue operator()(const Lanes& q, const Lanes& stiffness, const Lanes& sharpness) const {
    const Lanes u = 1 + 0.5F * q * sharpness;
    return {stiffness / sharpness * fast_log(u), stiffness / u};
  }
};
struct Power {
  explicit Power(float a) : inverse(1 / (2 - a)), half(a / 2 - 1), factor((2 - a) / a) {}
  CREASE_LANES_INLINE PotentialValue operator()(const Lanes& q, const Lanes& stiffness, const Lanes& sharpness) const {
    const Lanes u = 1 + q * sharpness * inverse, label = fast_exp(half * fast_log(u));
    return {factor * stiffness / sharpness * (label * u - 1), stiffness * label};
  }
  float inverse, half, factor;
};

/// What `body` makes of the potential with exponent `a`.
template <typename Body>
CREASE_LANES_INLINE auto with_potential(float a, Body body) {
  if (a == 2) return body(Quadratic());
  if (a == 1) return body(SquareRoot());
  if (a == 0) return body(Logarithm());
  return body(Power(a));
}

CREASE_LANES_INLINE LaneVectors gathered(const LaneRow* rows, const FlatIndex* places) {
  return transposed([&](std::size_t k) { return rows[places[k]].row; });
}

using Indices = std::array<const FlatIndex*, 3>;

/// Fading normals of blocks of eight faces, and one over their lengths before.
CREASE_WIDE_CLONES void find_normals(const Indices& corners, const LaneRow* points, float fading_area, LaneRow* normals,
                                     float* inverse_lengths, std::size_t begin, std::size_t end) {
  const float h2 = fading_area * fading_area;
  for (std::size_t f = begin * kLaneCount; f < end * kLaneCount; f += kLaneCount) {
    const LaneVectors origin = gathered(points, corners[0] + f);
    const LaneVectors area =
        cross(gathered(points, corners[1] + f) - origin, gathered(points, corners[2] + f) - origin);
    const Lanes inverse = 1 / sqrt(area.squared_norm() + h2);
    store(inverse, inverse_lengths + f);
    put_rows(inverse * area, [&](std::size_t k) -> HalfLanes& { return normals[f + k].row; });
  }
}

struct Faces {
  Indices corners, neighbors;
  const LaneRow *points, *normals;
  const float *inverse_lengths, *least_areas;
  const SideLanes* sides;
  const LaneVectors *references, *targets;
  float fold_weight;
  float* stiffness;
  LaneRow* by_corner;
};

/// Terms of the edges, of which each face has a half, and of the faces.
struct FaceSums {
  double edges = 0, faces = 0;
  FaceSums& operator+=(const FaceSums& other) {
    edges += other.edges;
    faces += other.faces;
    return *this;
  }
};

/// Terms of blocks of eight faces, and what they and their sides give to the gradient at their corners.
template <bool kHasTargets, typename Potential>
CREASE_LANES_INLINE FaceSums sum_faces_of(const Faces& faces, Potential potential, std::size_t begin, std::size_t end) {
  Lanes edge_terms{}, face_terms{};
  for (std::size_t block = begin; block < end; ++block) {
    const std::size_t f = block * kLaneCount;
    const LaneVectors n = transposed([&](std::size_t k) { return faces.normals[f + k].row; });
    LaneVectors by_normal;
    Lanes stiffness{};
    for (std::size_t k = 0; k < 3; ++k) {
      const LaneVectors turn = n - gathered(faces.normals, faces.neighbors[k] + f);
      const SideLanes& sides = faces.sides[block];
      const PotentialValue value = potential(turn.squared_norm(), sides.stiffness[k], sides.sharpness[k]);
      edge_terms += 0.5F * value.term;
      stiffness += value.slope;
      by_normal = by_normal + value.slope * turn;
    }
    store(stiffness, faces.stiffness + f);
    if constexpr (kHasTargets) {
      const LaneVectors& target = faces.targets[block];
      const LaneVectors miss = target.squared_norm() * (n - target);
      face_terms += 0.5F * miss.squared_norm();
      by_normal = by_normal + miss;
    }
    const LaneVectors& reference = faces.references[block];
    const Lanes inverse = eight(faces.inverse_lengths + f);
    const Lanes missing = eight(faces.least_areas + f) - dot(n, reference) / inverse,  // τ − N·r
        lack = missing > 0 ? missing : Lanes{};
    face_terms += faces.fold_weight * lack * lack;
    const LaneVectors by_area = inverse * (by_normal - dot(n, by_normal) * n) - 2 * faces.fold_weight * lack * reference;
    const LaneVectors origin = gathered(faces.points, faces.corners[0] + f);
    const LaneVectors first = cross(gathered(faces.points, faces.corners[2] + f) - origin, by_area),
                      second = cross(by_area, gathered(faces.points, faces.corners[1] + f) - origin);
    LaneRow* const by_corner = faces.by_corner + 3 * f;
    put_rows(LaneVectors() - first - second, [&](std::size_t k) -> HalfLanes& { return by_corner[3 * k].row; });
    put_rows(first, [&](std::size_t k) -> HalfLanes& { return by_corner[3 * k + 1].row; });
    put_rows(second, [&](std::size_t k) -> HalfLanes& { return by_corner[3 * k + 2].row; });
  }
  return {static_cast<double>(sum(edge_terms)), static_cast<double>(sum(face_terms))};
}

CREASE_WIDE_CLONES FaceSums sum_faces(const Faces& faces, float exponent, std::size_t begin, std::size_t end) {
  return with_potential(exponent, [&](const auto& potential) [[gnu::always_inline]] {
    return faces.targets == nullptr ? sum_faces_of<false>(faces, potential, begin, end)
                                    : sum_faces_of<true>(faces, potential, begin, end);
  });
}

struct Vertices {
  Flat positions, measured, normals;
  const float* precisions;
  float likelihood, across;
  const LaneRow* by_corner;
  float* __restrict x, * __restrict y, * __restrict z;  ///< of the gradient
};

/// Terms of the likelihood, and the gradient at vertices, of which there are no more than kBlock.
CREASE_WIDE_CLONES float sum_vertices(const Vertices& vertices, const IndexRows& corners, std::size_t begin,
                                      std::size_t end) {
  for (std::size_t v = begin; v < end; ++v) {
    HalfLanes sum{};
    for (Index i = corners.starts[v]; i < corners.starts[v + 1]; ++i) sum += vertices.by_corner[corners.items[i]].row;
    vertices.x[v] = sum[0];
    vertices.y[v] = sum[1];
    vertices.z[v] = sum[2];
  }
  BlockNumbers terms;
  const Flat p = vertices.positions, y = vertices.measured, m = vertices.normals;
  const float t = vertices.across, weight = vertices.likelihood;
  float* __restrict gx = vertices.x, * __restrict gy = vertices.y, * __restrict gz = vertices.z;
  CREASE_INDEPENDENT_PASSES
  for (std::size_t v = begin; v < end; ++v) {
    const float dx = p.x[v] - y.x[v], dy = p.y[v] - y.y[v], dz = p.z[v] - y.z[v];
    const float along = dx * m.x[v] + dy * m.y[v] + dz * m.z[v], w = weight * vertices.precisions[v];
    terms[v - begin] = w * (t * (dx * dx + dy * dy + dz * dz) + (1 - t) * along * along);
    const float k = 2 * w * t, l = 2 * w * (1 - t) * along;
    gx[v] += k * dx + l * m.x[v];
    gy[v] += k * dy + l * m.y[v];
    gz[v] += k * dz + l * m.z[v];
  }
  return sum_of(terms.data(), end - begin);
}

/// `values(begin, end)` summed over blocks of `size` of [0, count).
template <typename Sum, typename Values>
Sum sum_blocks(std::size_t count, std::size_t size, ThreadTeam& team, Values values) {
  constexpr std::size_t kBlocksATime = 2;
  std::vector<Sum> sums((count + size - 1) / size);
  team.run(sums.size(), kBlocksATime, [&](std::size_t first, std::size_t last, std::size_t) {
    for (std::size_t block = first; block < last; ++block) {
      sums[block] = values(block * size, std::min(count, (block + 1) * size));
    }
  });
  Sum total{};
  for (const Sum& sum : sums) total += sum;
  return total;
}

Indices pointers(const std::array<std::vector<FlatIndex>, 3>& three) {
  return {three[0].data(), three[1].data(), three[2].data()};
}

}  // namespace

GraduatedEnergy::GraduatedEnergy(const FlatMesh& mesh, std::span<const float> data)
    : measured(data),
      precisions(mesh.vertex_count, 1),
      vertex_normals(3 * mesh.vertex_count, 0),
      face_references(mesh.face_blocks()),
      least_areas(kLaneCount * mesh.face_blocks(), 0),
      mesh_(mesh),
      edges_(mesh.edge_count + 1),
      sides_(mesh.face_blocks()),
      points_(mesh.vertex_count),
      normals_(kLaneCount * mesh.face_blocks()),
      inverse_lengths_(kLaneCount * mesh.face_blocks()),
      face_stiffness_(kLaneCount * mesh.face_blocks()),
      by_corner_(3 * kLaneCount * mesh.face_blocks()) {}

void GraduatedEnergy::set_edges(ThreadTeam& team, const std::function<EdgeTerm(std::size_t edge)>& term_of) {
  team.run(mesh_.edge_count, kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t e = begin; e < end; ++e) edges_[e] = term_of(e);
  });
  team.run(sides_.size(), kLaneBlocks, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t f = begin * kLaneCount; f < std::min(mesh_.face_count, end * kLaneCount); ++f) {
      SideLanes& sides = sides_[f / kLaneCount];
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [weight, scale] = edges_[static_cast<std::size_t>(mesh_.sides[k][f])];
        sides.stiffness[k][f % kLaneCount] = weight / scale;
        sides.sharpness[k][f % kLaneCount] = 1 / (scale * scale);
      }
    }
  });
}

double GraduatedEnergy::operator()(std::span<const float> positions, std::span<float> gradient, ThreadTeam& team) {
  const Indices corners = pointers(mesh_.corners), neighbors = pointers(mesh_.neighbors);
  const std::size_t vertices = mesh_.vertex_count, blocks = mesh_.face_blocks();
  const Flat p = flat(positions);
  team.run(vertices, kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t v = begin; v < end; ++v) points_[v].row = HalfLanes{p.x[v], p.y[v], p.z[v], 0};
  });
  team.run(blocks, kLaneBlocks, [&](std::size_t begin, std::size_t end, std::size_t) {
    find_normals(corners, points_.data(), fading_area, normals_.data(), inverse_lengths_.data(), begin, end);
  });
  const Faces faces{corners,
                    neighbors,
                    points_.data(),
                    normals_.data(),
                    inverse_lengths_.data(),
                    least_areas.data(),
                    sides_.data(),
                    face_references.data(),
                    face_targets.empty() ? nullptr : face_targets.data(),
                    fold_weight,
                    face_stiffness_.data(),
                    by_corner_.data()};
  const auto sums = sum_blocks<FaceSums>(blocks, kLaneBlocks, team, [&](std::size_t begin, std::size_t end) {
    return sum_faces(faces, exponent, begin, end);
  });
  parts_.smoothness = sums.edges;
  parts_.folds = sums.faces;
  const Vertices all_vertices{p,
                              flat(measured),
                              flat(vertex_normals),
                              precisions.data(),
                              likelihood,
                              across,
                              by_corner_.data(),
                              gradient.data(),
                              gradient.data() + vertices,
                              gradient.data() + 2 * vertices};
  parts_.likelihood = sum_blocks<double>(vertices, kBlock, team, [&](std::size_t begin, std::size_t end) {
    return static_cast<double>(sum_vertices(all_vertices, mesh_.vertex_corners, begin, end));
  });
  return parts_.total();
}

std::vector<float> GraduatedEnergy::stiffness() const {
  std::vector<float> result(mesh_.edge_count);
  for (std::size_t e = 0; e < result.size(); ++e) {
    const auto normal = [&](std::size_t side) {
      return normals_[static_cast<std::size_t>(mesh_.edge_faces[side][e])].row;
    };
    const HalfLanes turn = normal(0) - normal(1), squares = turn * turn;
    const auto [weight, scale] = edges_[e];
    const Lanes q = squares[0] + squares[1] + squares[2] + Lanes{}, rest = weight / scale + Lanes{},
                sharpness = 1 / (scale * scale) + Lanes{};
    result[e] = with_potential(exponent, [&](const auto& potential) { return potential(q, rest, sharpness).slope[0]; });
  }
  return result;
}

std::vector<float> GraduatedEnergy::inverse_curvatures(std::span<const float> positions, ThreadTeam& team) const {
  const FlatMesh& mesh = mesh_;
  const Flat p = flat(positions);
  const std::size_t vertices = mesh.vertex_count;
  std::vector<float> result(3 * vertices);
  const float of_target = face_targets.empty() ? 0 : 1;
  team.run(vertices, kBlock, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t v = begin; v < end; ++v) {
      float sum = 2 * likelihood * precisions[v] * std::max(1.0F, across);
      for (const Index place : mesh.vertex_corners[v]) {
        const std::size_t f = place / 3, k = place % 3;
        const FlatIndex a = mesh.corners[(k + 1) % 3][f], b = mesh.corners[(k + 2) % 3][f];
        const float x = p.x[a] - p.x[b], y = p.y[a] - p.y[b], z = p.z[a] - p.z[b], r = inverse_lengths_[f];
        sum += (face_stiffness_[f] + of_target) * (x * x + y * y + z * z) * r * r;
      }
      result[v] = result[vertices + v] = result[2 * vertices + v] = sum > 0 ? 1 / sum : 1;
    }
  });
  return result;
}

}  // namespace crease
