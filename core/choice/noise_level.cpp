#include "core/choice/noise_level.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/quantile.h"
#include "core/mesh/pooled_variance.h"

namespace crease {
namespace {

constexpr std::size_t kMostFits = 4000, kMostNeighbours = 60, kMostValence = 32, kLeastRing = 10;
constexpr double kLeastFreedom = 4;

/// Unit normals, smoothed over two rings.
std::vector<Vec3> smoothed_normals(const Surface& surface, ThreadTeam& team) {
  const Topology& topology = surface.topology;
  std::vector<Vec3> normals(surface.measured.size()), sums(normals.size());
  for_each(normals.size(), team, [&](std::size_t v) {
    normals[v] = Vec3::Zero();
    for (const Index f : topology.vertex_faces[v]) normals[v] += surface.area_vector(f);
  });
  for (int round = 0; round < 2; ++round) {
    for_each(normals.size(), team, [&](std::size_t v) {
      sums[v] = normals[v];
      for (const Index e : topology.vertex_edges[v]) {
        if (topology.is_interior(e)) sums[v] += normals[other_end(topology.edges[e], static_cast<Index>(v))];
      }
    });
    normals.swap(sums);
  }
  for_each(normals.size(), team, [&](std::size_t v) { normals[v] = direction(normals[v]); });
  return normals;
}

double folded_share(const Surface& surface, const std::vector<Vec3>& normals, ThreadTeam& team) {
  const auto folded = block_sum<std::size_t>(surface.faces.size(), team, [&](std::size_t f) {
    const auto& [a, b, c] = surface.faces[f];
    return surface.area_vector(f).dot(normals[a] + normals[b] + normals[c]) < 0 ? std::size_t{1} : 0;
  });
  return static_cast<double>(folded) / static_cast<double>(surface.faces.size());
}

/// The way of each vertex to the mean of its neighbours; zero without any.
std::vector<Vec3> ways_to_means(const Surface& surface, ThreadTeam& team) {
  std::vector<Vec3> ways(surface.measured.size(), Vec3::Zero());
  for_each(ways.size(), team, [&](std::size_t v) {
    const std::size_t count = surface.topology.vertex_edges[v].size();
    if (count == 0) return;
    surface.visit_vertex_neighbors(static_cast<Index>(v), [&](Index other) { ways[v] += surface.measured[other]; });
    ways[v] = ways[v] / static_cast<double>(count) - surface.measured[v];
  });
  return ways;
}

/// Those inside the surface that have neighbours enough.
std::vector<std::uint8_t> surrounded_vertices(const Surface& surface) {
  std::vector<std::uint8_t> surrounded = inner_vertices(surface.topology);
  for (std::size_t v = 0; v < surrounded.size(); ++v) {
    if (surface.topology.vertex_edges[v].size() < 3) surrounded[v] = 0;
  }
  return surrounded;
}

WithinSurface look_within_surface(const Surface& surface, const std::vector<Vec3>& normals,
                                  const std::vector<Vec3>& ways, const std::vector<std::uint8_t>& surrounded) {
  constexpr double kMedianOfSquares = 0.693;  // ln 2: of half the sum of two squared standard normals
  std::vector<Vec3> parts(ways.size());
  std::vector<double> squares;
  for (std::size_t v = 0; v < ways.size(); ++v) {
    if (surrounded[v] == 0) continue;
    parts[v] = ways[v] - ways[v].dot(normals[v]) * normals[v];
    const auto count = static_cast<double>(surface.topology.vertex_edges[v].size());
    squares.push_back(parts[v].squaredNorm() / 2 / (1 + 1 / count));
  }
  WithinSurface within;
  const double median = quantile(squares, 0.5);
  within.sigma = std::sqrt(median / kMedianOfSquares);
  if (!(median > 0)) return within;
  within.quantiles = quantiles(std::move(squares), WithinSurface::kShares);
  for (double& square : within.quantiles) square /= median;
  double products = 0, own = 0;
  for (const auto& [a, b] : surface.topology.edges) {
    if (surrounded[a] == 0 || surrounded[b] == 0) continue;
    products += parts[a].dot(parts[b]);
    own += (parts[a].squaredNorm() + parts[b].squaredNorm()) / 2;
  }
  if (own > 0) within.alikeness = products / own;
  return within;
}

LoneImpulses find_lone_impulses(const Surface& surface, const std::vector<Vec3>& normals, const std::vector<Vec3>& ways,
                                const std::vector<std::uint8_t>& surrounded, ThreadTeam& team) {
  constexpr double kUnusual = 6, kLeast = 0.02, kMostAround = 0.35, kFewest = 3;
  std::vector<double> heights(ways.size()), usual;
  for (std::size_t v = 0; v < ways.size(); ++v) {
    heights[v] = -ways[v].dot(normals[v]);
    if (surrounded[v] != 0) usual.push_back(std::abs(heights[v]));
  }
  const auto count = static_cast<double>(std::max<std::size_t>(1, usual.size()));
  const double least = std::max(kLeast, kUnusual * quantile(std::move(usual), 0.5));
  const auto is_lone = [&](std::size_t v) {
    if (surrounded[v] == 0 || !(std::abs(heights[v]) > least)) return false;
    double most = 0;
    surface.visit_vertex_neighbors(static_cast<Index>(v), [&](Index other) {
      const double share =
          normals[v].dot(normals[other]) / static_cast<double>(surface.topology.vertex_edges[other].size());
      most = std::max(most, std::abs(heights[other] + share * heights[v]));
    });
    return most < kMostAround * std::abs(heights[v]);
  };
  struct Sums {
    double count = 0, squares = 0;
    Sums& operator+=(const Sums& other) {
      count += other.count;
      squares += other.squares;
      return *this;
    }
  };
  const Sums sums = block_sum<Sums>(ways.size(), team, [&](std::size_t v) {
    return is_lone(v) ? Sums{1, heights[v] * heights[v]} : Sums{};
  });
  if (sums.count < kFewest) return {};
  return {sums.count / count, std::sqrt(sums.squares / sums.count)};
}

/// The neighbourhood of a vertex up to two edges away, the vertex first.
class Ring {
 public:
  explicit Ring(const Surface& surface) : surface_(surface), seen_(surface.measured.size(), kNone) {}

  const std::vector<Index>& around(Index vertex) {
    ring_.assign(1, vertex);
    seen_[vertex] = vertex;
    add_neighbors(vertex, vertex);
    const std::size_t first_end = ring_.size();
    for (std::size_t i = 1; i < first_end; ++i) {
      // A hub's neighbours are no neighbourhood.
      if (surface_.topology.vertex_edges[ring_[i]].size() <= kMostValence) add_neighbors(ring_[i], vertex);
    }
    return ring_;
  }

 private:
  void add_neighbors(Index of, Index center) {
    surface_.visit_vertex_neighbors(of, [&](Index other) {
      if (seen_[other] == center || ring_.size() >= kMostNeighbours) return;
      seen_[other] = center;
      ring_.push_back(other);
    });
  }

  const Surface& surface_;
  std::vector<Index> seen_, ring_;
};

/// Heights over the plane across `normal`, fitted by 1, x, y, x², xy, y². Normal equations by elimination; a pivot that
/// vanishes is a term that the ring cannot tell from the others.
std::optional<FitVariance> fit_quadric(const Surface& surface, const std::vector<Index>& ring, const Vec3& normal) {
  constexpr std::size_t kTerms = 6;
  const Vec3 right = normal.unitOrthogonal(), up = normal.cross(right), center = surface.measured[ring.front()];
  double spread = 0;
  for (const Index v : ring) {
    const Vec3 offset = surface.measured[v] - center;
    spread += offset.squaredNorm() - std::pow(offset.dot(normal), 2);
  }
  const auto count = static_cast<double>(ring.size());
  const double scale = 1 / std::sqrt(std::max(spread / count, 1e-12));
  std::array<std::array<double, kTerms + 1>, kTerms> matrix{};
  double squares = 0;
  for (const Index v : ring) {
    const Vec3 offset = surface.measured[v] - center;
    const double x = offset.dot(right) * scale, y = offset.dot(up) * scale, height = offset.dot(normal);
    const std::array<double, kTerms + 1> row = {1, x, y, x * x, x * y, y * y, height};
    for (std::size_t i = 0; i < kTerms; ++i) {
      for (std::size_t j = i; j <= kTerms; ++j) matrix[i][j] += row[i] * row[j];
    }
    squares += height * height;
  }
  double rank = 0;
  std::array<double, kTerms> diagonal{};
  for (std::size_t i = 0; i < kTerms; ++i) diagonal[i] = matrix[i][i];
  for (std::size_t i = 0; i < kTerms; ++i) {
    if (matrix[i][i] < 1e-7 * diagonal[i] + 1e-300) continue;
    ++rank;
    for (std::size_t j = i + 1; j < kTerms; ++j) {
      const double factor = matrix[i][j] / matrix[i][i];
      for (std::size_t k = j; k <= kTerms; ++k) matrix[j][k] -= factor * matrix[i][k];
    }
    squares -= matrix[i][kTerms] * matrix[i][kTerms] / matrix[i][i];
  }
  if (count - rank < kLeastFreedom) return std::nullopt;
  return FitVariance{std::max(squares, 0.0) / (count - rank), count - rank};
}

/// None where there is too little around a vertex.
std::optional<FitVariance> fit_around(const Surface& surface, Index vertex, const Vec3& normal, Ring& ring) {
  const std::size_t valence = surface.topology.vertex_edges[vertex].size();
  if (valence == 0 || valence > kMostValence || normal.isZero()) return std::nullopt;
  const std::vector<Index>& around = ring.around(vertex);
  return around.size() < kLeastRing ? std::nullopt : fit_quadric(surface, around, normal);
}

std::vector<FitVariance> fit_quadrics(const Surface& surface, const std::vector<Vec3>& normals, ThreadTeam& team) {
  constexpr std::size_t kFitsATime = 64;
  const std::size_t count = surface.measured.size(), stride = (count + kMostFits - 1) / kMostFits;
  std::vector<std::optional<FitVariance>> found((count + stride - 1) / stride);
  std::vector<Ring> rings(team.size(), Ring(surface));
  team.run(found.size(), kFitsATime, [&](std::size_t begin, std::size_t end, std::size_t thread) {
    for (std::size_t i = begin; i < end; ++i) {
      found[i] = fit_around(surface, static_cast<Index>(i * stride), normals[i * stride], rings[thread]);
    }
  });
  std::vector<FitVariance> fits;
  for (const auto& fit : found) {
    if (fit) fits.push_back(*fit);
  }
  return fits;
}

}  // namespace

NoiseLevel estimate_noise_level(const Surface& surface, ThreadTeam& team) {
  constexpr std::size_t kLeastFits = 5;
  const std::vector<Vec3> normals = smoothed_normals(surface, team);
  NoiseLevel level;
  level.folded_share = folded_share(surface, normals, team);
  const std::vector<Vec3> ways = ways_to_means(surface, team);
  const std::vector<std::uint8_t> surrounded = surrounded_vertices(surface);
  level.within = look_within_surface(surface, normals, ways, surrounded);
  level.impulses = find_lone_impulses(surface, normals, ways, surrounded, team);
  const std::vector<FitVariance> fits = fit_quadrics(surface, normals, team);
  if (fits.size() >= kLeastFits) level.sigma = std::sqrt(pooled_variance(fits));
  return level;
}

}  // namespace crease
