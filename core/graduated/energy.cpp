#include "core/graduated/energy.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/graduated/fast_math.h"

namespace crease {
namespace {

/// Vertices of a block: its terms fit into the cache, and its sum does not depend on threads.
constexpr std::size_t kBlock = 1024;
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
    const Lanes root = sqrt(1 + q * sharpness), share = stiffness / (root * (root + 1));
    return {share * root * q, share * (root + 1)};
  }
};
struct Logarithm {
  CREASE_LANES_INLINE PotentialValue operator()(const Lanes& q, const Lanes& stiffness, const Lanes& sharpness) const {
    const Lanes u = 1 + 0.5F * q * sharpness;
    const Lanes inverse = stiffness / (sharpness * u);
    return {u * inverse * fast_log(u), sharpness * inverse};
  }
};
/// Its label is a power a/2 − 1, a multiple of an eighth: by square roots, since a logarithm and an exponential take as
/// long as all the rest of a face.
struct Roots {
  explicit Roots(float a) : eighths(static_cast<int>(8 - 4 * a)), inverse(1 / (2 - a)), factor((2 - a) / a) {}
  CREASE_LANES_INLINE PotentialValue operator()(const Lanes& q, const Lanes& stiffness, const Lanes& sharpness) const {
    const Lanes u = 1 + q * sharpness * inverse;
    Lanes power = eighths >= 16 ? u * u : eighths >= 8 ? u : 1 + Lanes{}, root = u;  // u to so many eighths
    for (int rest = eighths % 8; rest > 0; rest = 2 * rest % 8) {
      root = sqrt(root);
      if (rest >= 4) power *= root;
    }
    const Lanes share = stiffness / (sharpness * power);
    return {factor * share * (u - power), sharpness * share};
  }
  int eighths;
  float inverse, factor;
};

/// What `body` makes of the potential with exponent `a`.
template <typename Body>
CREASE_LANES_INLINE auto with_potential(float a, Body body) {
  if (a == 2) return body(Quadratic());
  if (a == 1) return body(SquareRoot());
  if (a == 0) return body(Logarithm());
  return body(Roots(a));
}

CREASE_LANES_INLINE LaneVectors gathered(const LaneRow* rows, const FaceTiles::Places& places) {
  return transposed([&](std::size_t k) { return rows[places[k]].row; });
}

CREASE_LANES_INLINE void add_rows(const LaneVectors& vectors, LaneRow* rows, const FaceTiles::Places& places) {
  LaneArray<4> pairs = row_pairs(vectors);
  for (std::size_t k = 0; k < 4; ++k) {
    rows[places[k]].row += low(pairs[k]);
    rows[places[k + 4]].row += high(pairs[k]);
  }
}

/// What is given of the faces, in blocks of eight.
struct Faces {
  const FaceTiles& tiles;
  Flat positions;
  const SideLanes* sides;
  const LaneVectors *references, *targets;
  const float* least_areas;
  float fading_area, exponent, fold_weight;
  float* curvatures;
  LaneRow* sums;
};

CREASE_LANES_INLINE void gather_points(const Faces& faces, const FaceTiles::Tile& tile, TileSpace& space) {
  const Flat p = faces.positions;
  const Index* vertex = faces.tiles.vertex.data() + tile.first_vertex;
  LaneRow* points = space.points.data();
  for (std::size_t i = 0; i < tile.vertices; ++i) {
    const Index v = vertex[i];
    points[i].row = HalfLanes{p.x[v], p.y[v], p.z[v], 0};
  }
}

/// Fading normals of the faces of a tile and of its rim.
CREASE_LANES_INLINE void find_normals(const Faces& faces, const FaceTiles::Tile& tile, TileSpace& space) {
  const float h2 = faces.fading_area * faces.fading_area;
  const LaneRow* points = space.points.data();
  LaneRow* normals = space.normals.data();
  float* inverse_lengths = space.inverse_lengths.data();
  for (std::size_t block = 0; block < tile.blocks; ++block) {
    const auto& corners = faces.tiles.corners[tile.first_block + block];
    const LaneVectors origin = gathered(points, corners[0]);
    const LaneVectors area = cross(gathered(points, corners[1]) - origin, gathered(points, corners[2]) - origin);
    const Lanes inverse = 1 / sqrt(area.squared_norm() + h2);
    store(inverse, inverse_lengths + block * kLaneCount);
    const LaneArray<4> pairs = row_pairs(inverse * area);
    for (std::size_t k = 0; k < 4; ++k) {
      normals[block * kLaneCount + k].row = low(pairs[k]);
      normals[block * kLaneCount + k + 4].row = high(pairs[k]);
    }
  }
}

/// Terms of the edges, of which each face has a half, and of the faces.
struct FaceSums {
  double edges = 0, faces = 0;
  FaceSums& operator+=(const FaceSums& other) {
    edges += other.edges;
    faces += other.faces;
    return *this;
  }
};

/// Terms of the faces of a tile, and what they and their sides give to the gradient at their corners.
template <bool kHasTargets, typename Potential>
CREASE_LANES_INLINE FaceSums sum_faces(const Faces& faces, std::size_t number, Potential potential, TileSpace& space) {
  const FaceTiles::Tile& tile = faces.tiles.tiles[number];
  const LaneRow *points = space.points.data(), *normals = space.normals.data();
  LaneRow* const sums = faces.sums + tile.first_sum;
  std::fill_n(sums, tile.sums, LaneRow());
  Lanes edge_terms{}, face_terms{};
  const std::size_t blocks = faces.tiles.blocks_of(number);
  for (std::size_t place = 0; place < blocks; ++place) {
    const std::size_t block = number * FaceTiles::kBlocks + place;
    const LaneVectors n = transposed([&](std::size_t k) { return normals[place * kLaneCount + k].row; });
    LaneVectors by_normal;
    Lanes stiffness{};
    for (std::size_t k = 0; k < 3; ++k) {
      const LaneVectors turn = n - gathered(normals, faces.tiles.neighbors[block][k]);
      const SideLanes& sides = faces.sides[block];
      const PotentialValue value = potential(turn.squared_norm(), sides.stiffness[k], sides.sharpness[k]);
      edge_terms += 0.5F * value.term;
      stiffness += value.slope;
      by_normal = by_normal + value.slope * turn;
    }
    if constexpr (kHasTargets) {
      const LaneVectors& target = faces.targets[block];
      const LaneVectors miss = target.squared_norm() * (n - target);
      face_terms += 0.5F * miss.squared_norm();
      stiffness += 1;
      by_normal = by_normal + miss;
    }
    const LaneVectors& reference = faces.references[block];
    const Lanes inverse = eight(space.inverse_lengths.data() + place * kLaneCount);
    store(stiffness * inverse * inverse, faces.curvatures + block * kLaneCount);
    const Lanes missing = eight(faces.least_areas + block * kLaneCount) - dot(n, reference) / inverse,  // τ − N·r
        lack = missing > 0 ? missing : Lanes{};
    face_terms += faces.fold_weight * lack * lack;
    const LaneVectors by_area =
        inverse * (by_normal - dot(n, by_normal) * n) - 2 * faces.fold_weight * lack * reference;
    const auto& corners = faces.tiles.corners[tile.first_block + place];
    const LaneVectors origin = gathered(points, corners[0]);
    const LaneVectors first = cross(gathered(points, corners[2]) - origin, by_area),
                      second = cross(by_area, gathered(points, corners[1]) - origin);
    add_rows(LaneVectors() - first - second, sums, corners[0]);
    add_rows(first, sums, corners[1]);
    add_rows(second, sums, corners[2]);
  }
  return {static_cast<double>(sum(edge_terms)), static_cast<double>(sum(face_terms))};
}

CREASE_WIDE_CLONES FaceSums sum_tile(const Faces& faces, std::size_t number, TileSpace& space) {
  const FaceTiles::Tile& tile = faces.tiles.tiles[number];
  gather_points(faces, tile, space);
  find_normals(faces, tile, space);
  return with_potential(faces.exponent, [&](const auto& potential) [[gnu::always_inline]] {
    return faces.targets == nullptr ? sum_faces<false>(faces, number, potential, space)
                                    : sum_faces<true>(faces, number, potential, space);
  });
}

struct Vertices {
  Flat positions, measured, normals;
  const float* precisions;
  float likelihood, across;
  const LaneRow* sums;
  float* __restrict x, * __restrict y, * __restrict z;  ///< of the gradient
};

/// Terms of the likelihood, and the gradient at vertices, of which there are no more than kBlock.
CREASE_WIDE_CLONES float sum_vertices(const Vertices& vertices, const IndexRows& rows, std::size_t begin,
                                      std::size_t end) {
  for (std::size_t v = begin; v < end; ++v) {
    HalfLanes sum{};
    for (Index i = rows.starts[v]; i < rows.starts[v + 1]; ++i) sum += vertices.sums[rows.items[i]].row;
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

/// `value(i, thread)` of [0, count), summed in order.
template <typename Sum, typename Value>
Sum sum_all(std::size_t count, ThreadTeam& team, Value value) {
  std::vector<Sum> values(count);
  team.run(count, 2, [&](std::size_t begin, std::size_t end, std::size_t thread) {
    for (std::size_t i = begin; i < end; ++i) values[i] = value(i, thread);
  });
  Sum total{};
  for (const Sum& sum : values) total += sum;
  return total;
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
      curvatures_(kLaneCount * mesh.face_blocks()),
      sums_(mesh.tiles.vertex_sums.items.size()) {}

void GraduatedEnergy::set_edges(ThreadTeam& team, const std::function<EdgeTerm(std::size_t edge)>& term_of) {
  team.run(mesh_.edge_count, kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t e = begin; e < end; ++e) edges_[e] = term_of(e);
  });
  team.run(sides_.size(), kChunk / kLaneCount, [&](std::size_t begin, std::size_t end, std::size_t) {
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
  const FaceTiles& tiles = mesh_.tiles;
  while (spaces_.size() < team.size()) {
    const std::size_t faces = kLaneCount * tiles.most_blocks;
    spaces_.push_back(
        {std::vector<LaneRow>(tiles.most_vertices), std::vector<LaneRow>(faces), std::vector<float>(faces)});
  }
  const Flat p = flat(positions);
  const Faces faces{tiles,
                    p,
                    sides_.data(),
                    face_references.data(),
                    face_targets.empty() ? nullptr : face_targets.data(),
                    least_areas.data(),
                    fading_area,
                    exponent,
                    fold_weight,
                    curvatures_.data(),
                    sums_.data()};
  const auto sums = sum_all<FaceSums>(tiles.tiles.size(), team, [&](std::size_t tile, std::size_t thread) {
    return sum_tile(faces, tile, spaces_[thread]);
  });
  parts_.smoothness = sums.edges;
  parts_.folds = sums.faces;
  const std::size_t count = mesh_.vertex_count;
  const Vertices vertices{
      p,      flat(measured), flat(vertex_normals), precisions.data(),       likelihood,
      across, sums_.data(),   gradient.data(),      gradient.data() + count, gradient.data() + 2 * count};
  parts_.likelihood = sum_all<double>((count + kBlock - 1) / kBlock, team, [&](std::size_t block, std::size_t) {
    const std::size_t begin = block * kBlock, end = std::min(count, begin + kBlock);
    return static_cast<double>(sum_vertices(vertices, tiles.vertex_sums, begin, end));
  });
  return parts_.total();
}

std::vector<float> GraduatedEnergy::stiffness(std::span<const float> positions) const {
  std::vector<float> result(mesh_.edge_count);
  for (std::size_t e = 0; e < result.size(); ++e) {
    const auto normal = [&](std::size_t side) {
      const auto [x, y, z] = area_vector(mesh_, positions, static_cast<std::size_t>(mesh_.edge_faces[side][e]));
      return HalfLanes{x, y, z, 0} / std::sqrt(x * x + y * y + z * z + fading_area * fading_area);
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
  team.run(vertices, kBlock, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t v = begin; v < end; ++v) {
      float sum = 2 * likelihood * precisions[v] * std::max(1.0F, across);
      for (const Index place : mesh.vertex_corners[v]) {
        const std::size_t f = place / 3, k = place % 3;
        const FlatIndex a = mesh.corners[(k + 1) % 3][f], b = mesh.corners[(k + 2) % 3][f];
        const float x = p.x[a] - p.x[b], y = p.y[a] - p.y[b], z = p.z[a] - p.z[b];
        sum += curvatures_[f] * (x * x + y * y + z * z);
      }
      result[v] = result[vertices + v] = result[2 * vertices + v] = sum > 0 ? 1 / sum : 1;
    }
  });
  return result;
}

}  // namespace crease
