#include "core/graduated/energy.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/graduated/fast_math.h"

namespace crease {
namespace {

/// Sites of a block: its terms fit into the cache, and its sum does not depend on threads.
constexpr std::size_t kBlock = 1024;
using BlockTerms = std::array<float, kBlock>;

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

struct Normals {
  float* __restrict x, * __restrict y, * __restrict z, * __restrict inverse;
};

CREASE_WIDE_CLONES void find_normals(const FlatIndex* __restrict i0, const FlatIndex* __restrict i1,
                                     const FlatIndex* __restrict i2, Flat p, float fading_area, Normals n,
                                     std::size_t begin, std::size_t end) {
  const float h2 = fading_area * fading_area;
  CREASE_INDEPENDENT_PASSES
  for (std::size_t f = begin; f < end; ++f) {
    const FlatIndex i = i0[f], j = i1[f], k = i2[f];
    const float ux = p.x[j] - p.x[i], uy = p.y[j] - p.y[i], uz = p.z[j] - p.z[i];
    const float vx = p.x[k] - p.x[i], vy = p.y[k] - p.y[i], vz = p.z[k] - p.z[i];
    const float cx = uy * vz - uz * vy, cy = uz * vx - ux * vz, cz = ux * vy - uy * vx;
    const float r = 1 / std::sqrt(cx * cx + cy * cy + cz * cz + h2);
    n.inverse[f] = r;
    n.x[f] = cx * r;
    n.y[f] = cy * r;
    n.z[f] = cz * r;
  }
}

struct Edges {
  const FlatIndex* __restrict face0, * __restrict face1;
  const float* __restrict weights, * __restrict scales;
  float* __restrict stiffness;
};

/// ψ and 2 ∂ψ/∂q of the edges of a block, each times the weight. `a` as in GraduatedEnergy.
template <typename Potential>
CREASE_LANES_INLINE void fill_edges(const Edges& edges, Flat n, std::size_t begin, std::size_t end, BlockTerms& terms,
                                    Potential potential) {
  CREASE_INDEPENDENT_PASSES
  for (std::size_t e = begin; e < end; ++e) {
    const FlatIndex i = edges.face0[e], j = edges.face1[e];
    const float x = n.x[i] - n.x[j], y = n.y[i] - n.y[j], z = n.z[i] - n.z[j];
    potential(x * x + y * y + z * z, edges.weights[e], edges.scales[e], terms[e - begin], edges.stiffness[e]);
  }
}

CREASE_WIDE_CLONES float sum_edges(const Edges& edges, Flat n, float a, std::size_t begin, std::size_t end) {
  BlockTerms terms;
  if (a == 2) {
    fill_edges(edges, n, begin, end, terms, [](float q, float w, float c, float& term, float& slope) {
      slope = w / c;
      term = 0.5F * slope * q;
    });
  } else if (a == 1) {
    fill_edges(edges, n, begin, end, terms, [](float q, float w, float c, float& term, float& slope) {
      const float root = std::sqrt(q + c * c);
      term = w * q / (root + c);
      slope = w / root;
    });
  } else if (a == 0) {
    fill_edges(edges, n, begin, end, terms, [](float q, float w, float c, float& term, float& slope) {
      const float u = 1 + q / (2 * c * c);
      term = w * c * fast_log(u);
      slope = w / (c * u);
    });
  } else {
    const float b = 2 - a, half = a / 2 - 1, factor = b / a;
    fill_edges(edges, n, begin, end, terms, [=](float q, float w, float c, float& term, float& slope) {
      const float u = 1 + q / (c * c * b), label = fast_exp(half * fast_log(u));
      term = w * c * factor * (label * u - 1);
      slope = w * label / c;
    });
  }
  return sum_of(terms.data(), end - begin);
}

struct Faces {
  std::array<const FlatIndex*, 3> corners, neighbors, sides;
  Flat positions, normals, references, targets;
  const float *inverse, *stiffness, *least_areas;
  float fold_weight;
  float* by_corner;
  std::size_t count;
};

/// What ∂E/∂n and the terms of faces give to their corners; returns the terms.
template <bool kHasTargets>
CREASE_LANES_INLINE float sum_faces_of(const Faces& faces, std::size_t begin, std::size_t end) {
  BlockTerms terms;
  const FlatIndex* __restrict i0 = faces.corners[0], * __restrict i1 = faces.corners[1], * __restrict i2 = faces.corners[2];
  const FlatIndex* __restrict n0 = faces.neighbors[0], * __restrict n1 = faces.neighbors[1], * __restrict n2 = faces.neighbors[2];
  const FlatIndex* __restrict e0 = faces.sides[0], * __restrict e1 = faces.sides[1], * __restrict e2 = faces.sides[2];
  const Flat p = faces.positions, n = faces.normals, r = faces.references, t = faces.targets;
  const float* __restrict inverse = faces.inverse, * __restrict stiffness = faces.stiffness, * __restrict least = faces.least_areas;
  const float weight = faces.fold_weight;
  float* __restrict x0 = faces.by_corner;
  float *__restrict x1 = x0 + faces.count, *__restrict x2 = x1 + faces.count, *__restrict y0 = x2 + faces.count,
                    *__restrict y1 = y0 + faces.count, *__restrict y2 = y1 + faces.count,
                    *__restrict z0 = y2 + faces.count, *__restrict z1 = z0 + faces.count,
                    *__restrict z2 = z1 + faces.count;
  CREASE_INDEPENDENT_PASSES
  for (std::size_t f = begin; f < end; ++f) {
    const FlatIndex a = n0[f], b = n1[f], c = n2[f];
    const float k0 = stiffness[e0[f]], k1 = stiffness[e1[f]], k2 = stiffness[e2[f]], k = k0 + k1 + k2;
    const float nx = n.x[f], ny = n.y[f], nz = n.z[f];
    float gx = k * nx - k0 * n.x[a] - k1 * n.x[b] - k2 * n.x[c];
    float gy = k * ny - k0 * n.y[a] - k1 * n.y[b] - k2 * n.y[c];
    float gz = k * nz - k0 * n.z[a] - k1 * n.z[b] - k2 * n.z[c];
    float miss = 0;
    if constexpr (kHasTargets) {
      const float weight_of_target = t.x[f] * t.x[f] + t.y[f] * t.y[f] + t.z[f] * t.z[f];
      const float dx = weight_of_target * (nx - t.x[f]), dy = weight_of_target * (ny - t.y[f]),
                  dz = weight_of_target * (nz - t.z[f]);
      miss = 0.5F * (dx * dx + dy * dy + dz * dz);
      gx += dx;
      gy += dy;
      gz += dz;
    }
    const float along = nx * gx + ny * gy + nz * gz, s = inverse[f];
    const float seen = (nx * r.x[f] + ny * r.y[f] + nz * r.z[f]) / s;  // N·r
    const float lack = std::max(0.0F, least[f] - seen), pull = -2 * weight * lack;
    terms[f - begin] = weight * lack * lack + miss;
    const float hx = s * (gx - along * nx) + pull * r.x[f];
    const float hy = s * (gy - along * ny) + pull * r.y[f];
    const float hz = s * (gz - along * nz) + pull * r.z[f];
    const FlatIndex i = i0[f], j = i1[f], l = i2[f];
    const float ux = p.x[j] - p.x[i], uy = p.y[j] - p.y[i], uz = p.z[j] - p.z[i];
    const float vx = p.x[l] - p.x[i], vy = p.y[l] - p.y[i], vz = p.z[l] - p.z[i];
    const float bx = vy * hz - vz * hy, by = vz * hx - vx * hz, bz = vx * hy - vy * hx;
    const float cx = hy * uz - hz * uy, cy = hz * ux - hx * uz, cz = hx * uy - hy * ux;
    x0[f] = -bx - cx;
    x1[f] = bx;
    x2[f] = cx;
    y0[f] = -by - cy;
    y1[f] = by;
    y2[f] = cy;
    z0[f] = -bz - cz;
    z1[f] = bz;
    z2[f] = cz;
  }
  return sum_of(terms.data(), end - begin);
}

CREASE_WIDE_CLONES float sum_faces(const Faces& faces, std::size_t begin, std::size_t end) {
  return sum_faces_of<false>(faces, begin, end);
}
CREASE_WIDE_CLONES float sum_faces_with_targets(const Faces& faces, std::size_t begin, std::size_t end) {
  return sum_faces_of<true>(faces, begin, end);
}

/// `values(begin, end)` summed over the blocks of [0, count).
template <typename Values>
double sum_blocks(std::size_t count, ThreadTeam& team, Values values) {
  constexpr std::size_t kBlocksATime = 2;
  std::vector<float> sums((count + kBlock - 1) / kBlock);
  team.run(sums.size(), kBlocksATime, [&](std::size_t first, std::size_t last, std::size_t) {
    for (std::size_t block = first; block < last; ++block) {
      sums[block] = values(block * kBlock, std::min(count, (block + 1) * kBlock));
    }
  });
  double total = 0;
  for (const float sum : sums) total += static_cast<double>(sum);
  return total;
}

}  // namespace

GraduatedEnergy::GraduatedEnergy(const FlatMesh& mesh, std::span<const float> data)
    : measured(data),
      edge_weights(mesh.edge_count, 1),
      edge_scales(mesh.edge_count, 1),
      precisions(mesh.vertex_count, 1),
      vertex_normals(3 * mesh.vertex_count, 0),
      face_references(3 * mesh.face_count, 0),
      least_areas(mesh.face_count, 0),
      mesh_(mesh),
      normals_(3 * mesh.face_count),
      inverse_lengths_(mesh.face_count),
      stiffness_(mesh.edge_count + 1, 0),
      by_corner_(9 * mesh.face_count) {}

double GraduatedEnergy::operator()(std::span<const float> positions, std::span<float> gradient, ThreadTeam& team) {
  const FlatMesh& mesh = mesh_;
  const Flat p = flat(positions), normals = flat(normals_), y = flat(measured), m = flat(vertex_normals);
  const std::size_t faces = mesh.face_count, vertices = mesh.vertex_count;
  float* n = normals_.data();
  team.run(faces, kBlock, [&](std::size_t begin, std::size_t end, std::size_t) {
    find_normals(mesh.corners[0].data(), mesh.corners[1].data(), mesh.corners[2].data(), p, fading_area,
                 {n, n + faces, n + 2 * faces, inverse_lengths_.data()}, begin, end);
  });
  const Edges edges{mesh.edge_faces[0].data(), mesh.edge_faces[1].data(), edge_weights.data(), edge_scales.data(),
                    stiffness_.data()};
  parts_.smoothness = sum_blocks(mesh.edge_count, team, [&](std::size_t begin, std::size_t end) {
    return sum_edges(edges, normals, exponent, begin, end);
  });
  const auto data = [](const std::array<std::vector<FlatIndex>, 3>& three) {
    return std::array{three[0].data(), three[1].data(), three[2].data()};
  };
  const Faces all_faces{data(mesh.corners),
                        data(mesh.neighbors),
                        data(mesh.sides),
                        p,
                        normals,
                        flat(face_references),
                        flat(face_targets),
                        inverse_lengths_.data(),
                        stiffness_.data(),
                        least_areas.data(),
                        fold_weight,
                        by_corner_.data(),
                        faces};
  const auto sum = face_targets.empty() ? sum_faces : sum_faces_with_targets;
  parts_.folds =
      sum_blocks(faces, team, [&](std::size_t begin, std::size_t end) { return sum(all_faces, begin, end); });
  const float *by_x = by_corner_.data(), *by_y = by_x + 3 * faces, *by_z = by_y + 3 * faces;
  const float t = across, weight = likelihood;
  parts_.likelihood = sum_blocks(vertices, team, [&](std::size_t begin, std::size_t end) {
    BlockTerms terms;
    for (std::size_t v = begin; v < end; ++v) {
      const float dx = p.x[v] - y.x[v], dy = p.y[v] - y.y[v], dz = p.z[v] - y.z[v];
      const float along = dx * m.x[v] + dy * m.y[v] + dz * m.z[v], w = weight * precisions[v];
      terms[v - begin] = w * (t * (dx * dx + dy * dy + dz * dz) + (1 - t) * along * along);
      const float k = 2 * w * t, l = 2 * w * (1 - t) * along;
      float gx = k * dx + l * m.x[v], gy = k * dy + l * m.y[v], gz = k * dz + l * m.z[v];
      for (const Index corner : mesh.vertex_corners[v]) {
        gx += by_x[corner];
        gy += by_y[corner];
        gz += by_z[corner];
      }
      gradient[v] = gx;
      gradient[vertices + v] = gy;
      gradient[2 * vertices + v] = gz;
    }
    return sum_of(terms.data(), end - begin);
  });
  return parts_.total();
}

std::vector<float> GraduatedEnergy::inverse_curvatures(std::span<const float> positions, ThreadTeam& team) const {
  const FlatMesh& mesh = mesh_;
  const std::size_t faces = mesh.face_count;
  const Flat p = flat(positions);
  const std::size_t vertices = mesh.vertex_count;
  std::vector<float> result(3 * vertices);
  team.run(vertices, kBlock, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t v = begin; v < end; ++v) {
      float sum = 2 * likelihood * precisions[v] * std::max(1.0F, across);
      for (const Index place : mesh.vertex_corners[v]) {
        const std::size_t f = place % faces, k = place / faces;
        const FlatIndex a = mesh.corners[(k + 1) % 3][f], b = mesh.corners[(k + 2) % 3][f];
        const float x = p.x[a] - p.x[b], y = p.y[a] - p.y[b], z = p.z[a] - p.z[b], r = inverse_lengths_[f];
        float stiffness = face_targets.empty() ? 0.0F : 1.0F;
        for (const std::vector<FlatIndex>& side : mesh.sides) {
          stiffness += stiffness_[static_cast<std::size_t>(side[f])];
        }
        sum += stiffness * (x * x + y * y + z * z) * r * r;
      }
      result[v] = result[vertices + v] = result[2 * vertices + v] = sum > 0 ? 1 / sum : 1;
    }
  });
  return result;
}

}  // namespace crease
