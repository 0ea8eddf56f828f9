#include "core/choice/noise_level.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/mesh/pooled_variance.h"

namespace crease {
namespace {

constexpr std::size_t kMostFits = 4000, kMostNeighbours = 60, kMostValence = 32, kLeastRing = 10;
constexpr double kLeastFreedom = 4;

/// Unit normals, smoothed over two rings.
std::vector<Vec3> smoothed_normals(const Surface& surface) {
  std::vector<Vec3> normals(surface.measured.size(), Vec3::Zero());
  for (std::size_t f = 0; f < surface.faces.size(); ++f) {
    for (const Index v : surface.faces[f]) normals[v] += surface.area_vector(f);
  }
  for (int round = 0; round < 2; ++round) {
    std::vector<Vec3> sums = normals;
    for (std::size_t e = 0; e < surface.topology.edges.size(); ++e) {
      if (!surface.topology.is_interior(e)) continue;
      const auto [v0, v1] = surface.topology.edges[e];
      sums[v0] += normals[v1];
      sums[v1] += normals[v0];
    }
    normals.swap(sums);
  }
  for (Vec3& normal : normals) normal = direction(normal);
  return normals;
}

double folded_share(const Surface& surface, const std::vector<Vec3>& normals) {
  std::size_t folded = 0;
  for (std::size_t f = 0; f < surface.faces.size(); ++f) {
    const auto& [a, b, c] = surface.faces[f];
    if (surface.area_vector(f).dot(normals[a] + normals[b] + normals[c]) < 0) ++folded;
  }
  return static_cast<double>(folded) / static_cast<double>(surface.faces.size());
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double tangential_sigma(const Surface& surface, const std::vector<Vec3>& normals) {
  constexpr double kMedianOfSquares = 0.693;  // ln 2: of half the sum of two squared standard normals
  const std::vector<std::uint8_t> inner = inner_vertices(surface.topology);
  std::vector<double> squares;
  for (std::size_t v = 0; v < inner.size(); ++v) {
    const auto count = static_cast<double>(surface.topology.vertex_edges[v].size());
    if (inner[v] == 0 || count < 3) continue;
    Vec3 sum = Vec3::Zero();
    surface.visit_vertex_neighbors(static_cast<Index>(v), [&](Index other) { sum += surface.measured[other]; });
    Vec3 umbrella = sum / count - surface.measured[v];
    umbrella -= umbrella.dot(normals[v]) * normals[v];
    squares.push_back(umbrella.squaredNorm() / 2 / (1 + 1 / count));
  }
  return squares.empty() ? 0 : std::sqrt(median_of(std::move(squares)) / kMedianOfSquares);
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

std::vector<FitVariance> fit_quadrics(const Surface& surface, const std::vector<Vec3>& normals) {
  std::vector<FitVariance> fits;
  Ring ring(surface);
  const std::size_t count = surface.measured.size(), stride = (count + kMostFits - 1) / kMostFits;
  for (std::size_t v = 0; v < count; v += stride) {
    const std::size_t valence = surface.topology.vertex_edges[v].size();
    if (valence == 0 || valence > kMostValence || normals[v].isZero()) continue;
    const std::vector<Index>& around = ring.around(static_cast<Index>(v));
    if (around.size() < kLeastRing) continue;
    if (const auto fit = fit_quadric(surface, around, normals[v])) fits.push_back(*fit);
  }
  return fits;
}

}  // namespace

NoiseLevel estimate_noise_level(const Surface& surface) {
  constexpr std::size_t kLeastFits = 5;
  const std::vector<Vec3> normals = smoothed_normals(surface);
  NoiseLevel level;
  level.folded_share = folded_share(surface, normals);
  level.sigma_tangential = tangential_sigma(surface, normals);
  const std::vector<FitVariance> fits = fit_quadrics(surface, normals);
  if (fits.size() >= kLeastFits) level.sigma = std::sqrt(pooled_variance(fits));
  return level;
}

}  // namespace crease
