#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/smooth/smooth.h"
#include "tests/quality/noise_models.h"
#include "tests/quality/parts.h"

namespace crease::quality {
namespace {

constexpr std::size_t kBins = 6;

/// A vertex of a result: its true error along its normal, and what the result says of it; in mean edge lengths.
struct Judged {
  double error = 0, sigma = 0;
};

std::vector<Judged> judged(const Mesh& original, Noise noise, double level) {
  const Mesh noisy = add_noise_of_kind(original, noise, level, 1);
  const Topology topology = build_topology(noisy);
  MrfOptions options;
  options.uncertainty = true;
  RunContext context;
  const SmoothResult result = smooth(noisy, topology, {options, 1}, context);
  const Surface surface({result.positions, noisy.triangles}, topology);
  std::vector<Vec3> normals(result.positions.size(), Vec3::Zero());
  for (std::size_t f = 0; f < surface.faces.size(); ++f) {
    for (const Index v : surface.faces[f]) normals[v] += surface.area_vector(f);
  }
  std::vector<Judged> vertices;
  for (std::size_t v = 0; v < normals.size(); ++v) {
    const double error = (result.positions[v] - original.positions[v]).dot(direction(normals[v]));
    vertices.push_back({std::abs(error) / surface.unit, result.sigma[v] / surface.unit});
  }
  return vertices;
}

/// Root mean square of the errors over that of the deviations.
double ratio_of(std::span<const Judged> vertices) {
  double errors = 0, variances = 0;
  for (const Judged& one : vertices) {
    errors += one.error * one.error;
    variances += one.sigma * one.sigma;
  }
  return std::sqrt(errors / variances);
}

/// 0, 1, … in the order of the values.
std::vector<double> ranks(const std::vector<Judged>& vertices, double Judged::*value) {
  std::vector<std::size_t> order(vertices.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return vertices[i].*value; });
  std::vector<double> result(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) result[order[k]] = static_cast<double>(k);
  return result;
}

/// Spearman's.
double rank_correlation(const std::vector<Judged>& vertices) {
  const std::vector<double> a = ranks(vertices, &Judged::error), b = ranks(vertices, &Judged::sigma);
  const double middle = static_cast<double>(a.size() - 1) / 2;
  double product = 0, square = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    product += (a[i] - middle) * (b[i] - middle);
    square += (a[i] - middle) * (a[i] - middle);
  }
  return product / square;
}

TEST(QualityOfUncertainty, AgreesWithTheTrueErrorOfParts) {
  struct Case {
    std::string name;
    Mesh mesh;
    Noise noise;
    double level;
  };
  const std::vector<Case> cases = {
      {"cut_box", cut_box(kRegular).mesh, Noise::kNormal, 0.2},
      {"cut_box_irregular", cut_box(kIrregular).mesh, Noise::kNormal, 0.3},
      {"shaft", shaft(kRegular).mesh, Noise::kNormal, 0.3},
      {"elbow", elbow(kRegular).mesh, Noise::kNormal, 0.2},
      {"cone", cone(kRegular).mesh, Noise::kNormal, 0.2},
      {"cut_box", cut_box(kRegular).mesh, Noise::kIsotropic, 0.3},
  };
  constexpr double kChance = 0.05;  // on flats all vertices are equally uncertain, and the ranks are chance
  std::vector<Judged> pooled;
  for (const Case& one : cases) {
    const std::vector<Judged> vertices = judged(one.mesh, one.noise, one.level);
    const double correlation = rank_correlation(vertices);
    fmt::print("  {}-{}-{}: ratio {:.2f}, rank correlation {:.2f}\n", one.name, word_of(one.noise), one.level,
               ratio_of(vertices), correlation);
    EXPECT_GT(correlation, -kChance) << one.name;
    pooled.insert(pooled.end(), vertices.begin(), vertices.end());
  }
  EXPECT_GT(rank_correlation(pooled), 0.15);
  std::ranges::sort(pooled, {}, &Judged::sigma);
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const std::size_t begin = pooled.size() * bin / kBins, end = pooled.size() * (bin + 1) / kBins;
    const double ratio = ratio_of(std::span(pooled).subspan(begin, end - begin));
    fmt::print("  sigma {:.3f} to {:.3f}: ratio {:.2f}\n", pooled[begin].sigma, pooled[end - 1].sigma, ratio);
    EXPECT_GT(ratio, 0.5);
    EXPECT_LT(ratio, 1.6);
  }
}

}  // namespace
}  // namespace crease::quality
