#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "core/choice/noise_spectrum.h"
#include "core/choice/scan_error.h"
#include "core/geometry/renumbering.h"
#include "core/graduated/descent.h"
#include "core/graduated/fast_math.h"
#include "core/graduated/hinge_metric.h"
#include "core/measure/measure.h"
#include "core/measure/noise.h"
#include "core/smooth/smooth.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

SmoothResult automatic(const Mesh& mesh, const MrfOptions& options = {}) {
  RunContext context;
  return smooth(mesh, build_topology(mesh), {options, 1}, context);
}

double error_of(const Mesh& original, const Mesh& noisy, const MrfOptions& options = {}) {
  Mesh result = noisy;
  result.positions = automatic(noisy, options).positions;
  return measure(original, result).mean_normal_error_deg;
}

TEST(FastMath, AgreesWithTheLibrary) {
  for (double x = 1e-6; x < 1e6; x *= 1.07) {
    const Lanes lanes = static_cast<float>(x) + Lanes{};
    EXPECT_NEAR(fast_log(lanes)[0], std::log(x), 4e-7 * std::max(1.0, std::abs(std::log(x))));
  }
  for (double x = -40; x < 40; x += 0.37) {
    const Lanes lanes = static_cast<float>(x) + Lanes{};
    EXPECT_NEAR(fast_exp(lanes)[0] / std::exp(x), 1, 2e-7 * (1 + std::abs(x))) << x;
  }
}

TEST(GraduatedEnergy, ItsGradientIsThatOfFiniteDifferences) {
  const Mesh mesh = add_noise(test::cube(3), 0.2, 1, NoiseKind::kGaussian);
  const Topology topology = build_topology(mesh);
  const Surface surface(mesh, topology);
  const FlatMesh flat(surface);
  ThreadTeam alone(1);
  for (float exponent = -2; exponent <= 2; exponent += 0.25F) {
    GraduatedEnergy energy(flat, flat.measured);
    energy.exponent = exponent;
    energy.fading_area = 0.1F;
    energy.across = 3;
    energy.set_edges(alone, [](std::size_t) -> EdgeTerm { return {.weight = 1, .scale = 0.3F}; });
    for (std::size_t f = 0; f < flat.face_count; ++f) energy.least_areas[f] = 0.4F;
    for (std::size_t v = 0; v < flat.vertex_count; ++v) energy.vertex_normals[v] = 1;
    for (std::size_t f = 0; f < flat.face_count; ++f) set_vector(energy.face_references, f, {0, 0, 1});
    if (exponent == 1) energy.face_targets = energy.face_references;
    FlatVectors x = flat.measured, gradient(x.size()), unused(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += 0.1F * std::sin(static_cast<float>(i));
    energy(x, gradient, alone);
    constexpr float kStep = 4e-3F;
    for (std::size_t i = 0; i < x.size(); i += 7) {
      const float at = x[i];
      x[i] = at + kStep;
      const double above = energy(x, unused, alone);
      x[i] = at - kStep;
      const double below = energy(x, unused, alone);
      x[i] = at;
      EXPECT_NEAR((above - below) / (2 * kStep), gradient[i], 0.02 * (1 + std::abs(gradient[i]))) << exponent;
    }
  }
}

/// Faces far apart that share a tile have all their neighbours in its rim.
TEST(GraduatedEnergy, DoesNotDependOnWhichFacesShareATile) {
  const Mesh mesh = Renumbering(add_noise(test::icosphere(4), 0.2, 1, NoiseKind::kGaussian)).mesh;
  Mesh shuffled = mesh;
  std::mt19937 random(1);
  std::ranges::shuffle(shuffled.triangles, random);
  ThreadTeam alone(1);
  const auto evaluated = [&](const Mesh& of, FlatVectors& gradient) {
    const FlatMesh flat{Surface(of, build_topology(of))};
    EXPECT_GT(flat.tiles.tiles.size(), 4U);
    GraduatedEnergy energy(flat, flat.measured);
    energy.exponent = -0.75F;
    energy.set_edges(alone, [](std::size_t) -> EdgeTerm { return {.weight = 1, .scale = 0.3F}; });
    for (std::size_t f = 0; f < flat.face_count; ++f) {
      energy.least_areas[f] = 0.4F;
      set_vector(energy.face_references, f, {0, 0, 1});
    }
    gradient.resize(flat.measured.size());
    return energy(flat.measured, gradient, alone);
  };
  FlatVectors gradient, of_shuffled;
  const double value = evaluated(mesh, gradient);
  EXPECT_NEAR(evaluated(shuffled, of_shuffled), value, 1e-5 * value);
  for (std::size_t i = 0; i < gradient.size(); ++i) EXPECT_NEAR(gradient[i], of_shuffled[i], 1e-3) << i;
}

/// What is left of a low wave along x, in the middle of a flat grid.
double share_of_wave(double length, const PotentialFamily& family, float weight) {
  constexpr int kSide = 40;
  constexpr double kHeight = 0.01, kFull = 2 * std::numbers::pi;
  Mesh mesh = test::grid(kSide, kSide);
  for (Vec3& p : mesh.positions) p.z() = kHeight * std::cos(kFull * (p.x() - kSide / 2.0) / length);
  const Topology topology = build_topology(mesh);
  const Surface surface(mesh, topology);
  const FlatMesh flat(surface);
  GraduatedOptions options;
  options.family = family;
  options.weight = weight;
  options.steps = 100;
  options.latent_variance = false;
  ThreadTeam alone(1);
  const FlatVectors result = GraduatedDescent(flat, flat.measured, options, {}, {}, alone).run().positions;
  double product = 0, square = 0;
  for (std::size_t v = 0; v < flat.vertex_count; ++v) {
    const Vec3& p = mesh.positions[v];
    if (std::abs(p.x() - kSide / 2.0) > length / 2 || std::abs(p.y() - kSide / 2.0) > 2) continue;
    const double before = static_cast<double>(flat.measured[2 * flat.vertex_count + v]);
    product += before * static_cast<double>(result[2 * flat.vertex_count + v]);
    square += before * before;
  }
  return product / square;
}

/// One step leaves 1/(1 + c k⁴) of a wave, n steps 1/(1 + c'k⁴)ⁿ: where both leave as much of a short one, n steps
/// leave more of a long one, by Bernoulli's inequality.
TEST(GraduatedDescent, ADiffusionKeepsMoreOfLongWavesThanOneStep) {
  PotentialFamily one_step{.name = "waves", .exponent_end = 2, .exponent_start = 2, .scale = 0.1F},
      diffusion = one_step;
  diffusion.diffuses_from = 1;
  constexpr float kWeight = 0.05F;
  const double of_short = share_of_wave(5, one_step, kWeight);
  EXPECT_GT(of_short, 0.02);
  EXPECT_LT(of_short, 0.6);
  float low = kWeight, high = 100 * kWeight;
  for (int halving = 0; halving < 8; ++halving) {
    const float middle = std::sqrt(low * high);
    (share_of_wave(5, diffusion, middle) < of_short ? low : high) = middle;
  }
  EXPECT_NEAR(share_of_wave(5, diffusion, low), of_short, 0.02);
  EXPECT_GT(share_of_wave(10, diffusion, low), share_of_wave(10, one_step, kWeight) + 0.03);
}

/// It once smoothed them with the others, and could not go back.
TEST(GraduatedDescent, ADiffusionRestoresVerticesThatNoiseLeftAlone) {
  constexpr std::size_t kMoved = 4;  // one of so many
  const Mesh original = test::icosphere(4);
  Mesh noisy = original;
  const double unit = mean_edge_length(original.positions, build_topology(original).edges);
  for (std::size_t v = 0; v < noisy.positions.size(); v += kMoved) {
    noisy.positions[v] *= 1 + 0.8 * unit * std::sin(12.9898 * static_cast<double>(v));
  }
  const Topology topology = build_topology(noisy);
  const Surface surface(noisy, topology);
  const FlatMesh flat(surface);
  GraduatedOptions options;
  options.family = {.name = "sphere", .exponent_end = 2, .exponent_start = 2, .scale = 0.1F, .diffuses_from = 1};
  options.variance = 0.08F;
  options.weight = 1;
  ThreadTeam alone(1);
  const auto moved = [&] {
    const GraduatedResult result = GraduatedDescent(flat, flat.measured, options, {}, {}, alone).run();
    EXPECT_EQ(result.latent.impulsive, options.latent_variance);
    double squares = 0;
    for (std::size_t v = 0; v < flat.vertex_count; ++v) {
      if (v % kMoved == 0) continue;
      for (std::size_t i = v; i < 3 * flat.vertex_count; i += flat.vertex_count) {
        squares += std::pow(static_cast<double>(result.positions[i] - flat.measured[i]), 2);
      }
    }
    return std::sqrt(squares);
  };
  const double restored = moved();
  options.latent_variance = false;
  EXPECT_LT(restored, 0.5 * moved());
}

TEST(HingeMetric, SolvesWhatItsMatrixMakes) {
  ThreadTeam alone(1);
  // Without stiffness H is the diagonal; and x·H⁻¹y = y·H⁻¹x always.
  const Mesh mesh = add_noise(test::cube(3), 0.1, 1, NoiseKind::kGaussian);
  const Topology topology = build_topology(mesh);
  const FlatMesh flat{Surface(mesh, topology)};
  HingeMetric metric(flat, alone);
  std::vector<float> stiffness(flat.edge_count, 0);
  std::vector<double> diagonal;
  FlatVectors x(3 * flat.vertex_count), y(x.size());
  for (std::size_t v = 0; v < flat.vertex_count; ++v) diagonal.push_back(1 + 0.1 * static_cast<double>(v % 5));
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = std::sin(static_cast<float>(i));
    y[i] = std::cos(3 * static_cast<float>(i));
  }
  const auto quotients = [&](FlatVectors sides) {
    metric.solve(sides);
    return sides;
  };
  const auto product = [](const FlatVectors& a, const FlatVectors& b) {
    return std::transform_reduce(a.begin(), a.end(), b.begin(), 0.0);
  };
  metric.factorize(flat.measured, stiffness, diagonal, 1e-3F);
  const FlatVectors divided = quotients(x);
  for (std::size_t i = 0; i < x.size(); ++i) {
    EXPECT_NEAR(divided[i], static_cast<double>(x[i]) / diagonal[i % flat.vertex_count], 1e-6);
  }

  for (float& one : stiffness) one = 2;
  metric.factorize(flat.measured, stiffness, diagonal, 1e-3F);
  const FlatVectors by_x = quotients(x);
  EXPECT_NEAR(product(y, by_x), product(x, quotients(y)), 1e-5);
  EXPECT_GT(product(x, by_x), 0);
  EXPECT_LT(product(x, by_x), product(x, divided));  // what is stiffer gives way less
}

/// Moves vertices along their normals by noise of many wavelengths that has the given deviation in edge
/// lengths.
Mesh with_correlated_noise(const Mesh& original, double sigma) {
  ThreadTeam alone(1);
  const Topology topology = build_topology(original);
  const Surface surface(original, topology);
  NoiseSpectrum spectrum;
  constexpr std::array kShares = {0.05, 0.05, 0.1, 0.2, 0.3, 0.3, 0.0, 0.0};  // of ever longer waves, as scanners'
  for (std::size_t k = 0; k < kShares.size(); ++k) spectrum.variances[k] = kShares[k] * sigma * sigma;
  const std::vector<double> noise = spectrum.sample(LazyWalk(surface, alone), original.positions.size(), 3);
  std::vector<Vec3> normals(noise.size(), Vec3::Zero());
  for (std::size_t f = 0; f < surface.faces.size(); ++f) {
    for (const Index v : surface.faces[f]) normals[v] += surface.area_vector(f);
  }
  Mesh noisy = original;
  for (std::size_t v = 0; v < noise.size(); ++v) noisy.positions[v] += surface.unit * noise[v] * direction(normals[v]);
  return noisy;
}

double correlation_length_of(const Mesh& mesh) { return automatic(mesh).choice.value().correlation_length; }

TEST(Automatic, TellsCorrelatedNoiseFromWhiteNoiseAndFromShape) {
  for (const Mesh& original : {test::cube(24), test::icosphere(4), test::cad_part(6).mesh}) {
    EXPECT_EQ(correlation_length_of(original), 0) << original.triangles.size();
    EXPECT_EQ(correlation_length_of(add_noise(original, 0.2, 1, NoiseKind::kNormal)), 0) << original.triangles.size();
  }
  EXPECT_GT(correlation_length_of(with_correlated_noise(test::cube(24), 0.5)), 1);
}

TEST(NoiseSpectrum, IsFoundOnEveryMeshWhenItIsAskedFor) {
  ThreadTeam alone(1);
  for (const auto& member : test::mesh_family()) {
    const Topology topology = build_topology(member.mesh);
    const auto spectrum = find_correlated_noise(Surface(member.mesh, topology), true, alone);
    ASSERT_TRUE(spectrum) << member.name;
    EXPECT_TRUE(std::isfinite(spectrum->sigma())) << member.name;
    for (const double number : scan_numbers(*spectrum)) EXPECT_TRUE(std::isfinite(number)) << member.name;
  }
}

TEST(ErrorModel, ExpectsTheMeanFarFromWhatItKnows) {
  using Model = ErrorModel<2, 1, Kernel::kGaussian>;
  const std::array<Model::Landmark, 1> landmarks{{{{}, {0.25}}}};
  const Model model{{10, 20}, {1, 2}, {0.5}, landmarks};
  EXPECT_DOUBLE_EQ(model.expected({10, 20})[0], 0.75);
  EXPECT_NEAR(model.expected({11, 20})[0], 0.5 + 0.25 * std::exp(-0.5), 1e-12);
  EXPECT_NEAR(model.expected({1e9, -1e9})[0], 0.5, 1e-3);
}

TEST(ErrorModel, WithAnExponentialKernelFallsWithTheDistance) {
  using Model = ErrorModel<2, 1, Kernel::kExponential>;
  const std::array<Model::Landmark, 1> landmarks{{{{}, {0.25}}}};
  const Model model{{10, 20}, {1, 2}, {0.5}, landmarks};
  EXPECT_DOUBLE_EQ(model.expected({10, 20})[0], 0.75);
  EXPECT_NEAR(model.expected({11, 20})[0], 0.5 + 0.25 * std::exp(-std::sqrt(0.5)), 1e-12);
}

TEST(ScanOdds, SeesTheShapeOfASpectrumApartFromItsSize) {
  NoiseSpectrum spectrum, multiple;
  for (std::size_t k = 0; k < kTellingBands; ++k) {
    const double low = std::exp2(static_cast<double>(k));
    spectrum.bands[k] = {low, 2 * low, 3 * low, 4 * low};
    multiple.bands[k] = {7 * low, 14 * low, 21 * low, 28 * low};
  }
  spectrum.capture = multiple.capture = {0.1, 0.9, 0.8};
  const auto numbers = scan_numbers(spectrum), of_multiple = scan_numbers(multiple);
  constexpr std::size_t kSize = 2 * kTellingBands - 1;
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    EXPECT_NEAR(of_multiple[k] - numbers[k], k == kSize ? std::log(7) : 0, 1e-12);
    if (k >= kSize) continue;
    EXPECT_NEAR(numbers[k], k + 1 < kTellingBands ? std::log(2) : std::log(4), 1e-12);
  }
  EXPECT_EQ(std::vector<double>(numbers.end() - 3, numbers.end()), (std::vector<double>{0.1, 0.9, 0.8}));
}

/// Squares that are all cut along the same diagonal.
Mesh pixel_grid(Index columns, Index rows) {
  Mesh mesh;
  for (Index v = 0; v <= rows; ++v) {
    for (Index u = 0; u <= columns; ++u) mesh.positions.emplace_back(u, v, 0);
  }
  for (Index v = 0; v < rows; ++v) {
    for (Index u = 0; u < columns; ++u) {
      const Index a = v * (columns + 1) + u, b = a + 1, c = a + columns + 1, d = c + 1;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({b, d, c});
    }
  }
  return mesh;
}

TEST(CaptureSigns, TellAViewFromWhatIsClosed) {
  const auto signs = [](const Mesh& mesh) {
    const Topology topology = build_topology(mesh);
    return capture_signs(Surface(mesh, topology));
  };
  const Mesh flat = pixel_grid(20, 20);
  const CaptureSigns grid = signs(flat), cube = signs(test::cube(6));
  EXPECT_DOUBLE_EQ(grid.facing, 1);
  EXPECT_DOUBLE_EQ(grid.exact_flats, 1);
  EXPECT_NEAR(grid.regular, 19.0 * 19 / (21 * 21), 1e-12);
  EXPECT_TRUE(grid.is_one_view());
  EXPECT_DOUBLE_EQ(cube.facing, 0.5);
  EXPECT_FALSE(cube.is_one_view());
  const CaptureSigns noisy = signs(add_noise(flat, 0.1, 1, NoiseKind::kNormal));
  EXPECT_LT(noisy.exact_flats, 0.05);
  EXPECT_TRUE(noisy.is_one_view());
}

/// Stein's risk alone once smoothed away what bends, and left flats as rough as they were.
TEST(Automatic, RemovesCorrelatedNoiseFromFlatAndFromCurvedSurfaces) {
  MrfOptions options;
  options.noise = NoiseOption::kCorrelated;
  const Mesh cube = test::cube(24), sphere = test::icosphere(3);
  EXPECT_LT(error_of(cube, with_correlated_noise(cube, 0.3), options), 2.5);
  const Mesh noisy = with_correlated_noise(sphere, 0.3);
  EXPECT_LT(error_of(sphere, noisy, options), 0.8 * measure(sphere, noisy).mean_normal_error_deg);
}

TEST(Automatic, RemovesCorrelatedNoiseFarBetterThanAsIfItWereWhite) {
  const Mesh original = test::cube(24), noisy = with_correlated_noise(original, 0.5);
  MrfOptions white;
  white.noise = NoiseOption::kNormal;
  EXPECT_LT(error_of(original, noisy), 0.6 * error_of(original, noisy, white));
}

TEST(Automatic, LeavesMeshesWithoutNoiseAllButUnchanged) {
  for (const Mesh& mesh : {test::cube(1), test::cube(8), test::cad_part(3).mesh, test::icosphere(3)}) {
    const SmoothResult result = automatic(mesh);
    const double unit = mean_edge_length(mesh.positions, build_topology(mesh).edges);
    double moved = 0;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      moved += (result.positions[v] - mesh.positions[v]).norm() / unit / static_cast<double>(mesh.positions.size());
    }
    EXPECT_LT(moved, 0.02) << mesh.triangles.size();
  }
}

/// A prism of one row over an outline that its first point sees whole.
Mesh prism(const std::vector<Vec3>& outline, double height) {
  const auto n = static_cast<Index>(outline.size());
  Mesh mesh;
  mesh.positions = outline;
  for (const Vec3& point : outline) mesh.positions.push_back(point + Vec3(0, 0, height));
  for (Index i = 0; i < n; ++i) {
    const Index next = (i + 1) % n;
    mesh.triangles.push_back({i, next, next + n});
    mesh.triangles.push_back({i, next + n, i + n});
    if (i == 0 || next == 0) continue;
    mesh.triangles.push_back({0, next, i});
    mesh.triangles.push_back({n, i + n, next + n});
  }
  return mesh;
}

TEST(Automatic, LeavesMeshesOfAFewVerticesAlone) {
  const std::vector<Vec3> angle = {{0, 0, 0}, {3, 0, 0}, {3, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}};
  std::vector<Vec3> hexagon;
  for (const double turn : {0, 60, 120, 180, 240, 300}) {
    hexagon.emplace_back(std::cos(turn * kDegree), std::sin(turn * kDegree), 0);
  }
  for (const Mesh& mesh : {prism(angle, 1), prism(hexagon, 1), test::cube(2)}) {
    const SmoothResult result = automatic(mesh);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      EXPECT_LT((result.positions[v] - mesh.positions[v]).norm(), 0.001) << mesh.positions.size();
    }
  }
}

TEST(Automatic, SmoothsACubeFarBetterThanItsNoise) {
  const Mesh original = test::cube(16);
  for (const NoiseKind kind : {NoiseKind::kNormal, NoiseKind::kGaussian}) {
    const Mesh noisy = add_noise(original, 0.3, 1, kind);
    EXPECT_LT(error_of(original, noisy), 0.15 * measure(original, noisy).mean_normal_error_deg);
  }
}

TEST(Automatic, SaysWhatItEstimated) {
  const Mesh noisy = add_noise(test::cube(20), 0.3, 1, NoiseKind::kNormal);
  const SmoothResult result = automatic(noisy);
  ASSERT_TRUE(result.choice);
  EXPECT_NEAR(result.choice->noise_sigma, 0.28, 0.04);
  EXPECT_EQ(result.choice->direction, NoiseDirection::kNormal);
  EXPECT_FALSE(result.choice->candidates.empty());
}

TEST(Automatic, StrengthZeroLeavesTheUploadAsItIs) {
  const Mesh noisy = add_noise(test::cube(6), 0.3, 1, NoiseKind::kNormal);
  MrfOptions options;
  options.strength = 0;
  EXPECT_EQ(automatic(noisy, options).positions, noisy.positions);
}

}  // namespace
}  // namespace crease
