#include "tests/quality/fit_scans.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <random>
#include <set>

#include "core/choice/choice.h"
#include "core/choice/scan_error.h"
#include "core/choice/scan_path.h"
#include "core/io/decode.h"
#include "tests/quality/error_fit.h"
#include "tests/quality/pairs.h"
#include "tests/support/meshes.h"

namespace crease::quality {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFewestOfScan = 1500, kMostOfScan = 13'000, kIndependent = kScanWeights.size();

struct ScanSample : Sample<ScanModel> {
  std::string noise;  ///< "correlated", "depth", or that of tests/quality/noise_models.h; "none"
  std::array<double, OddsModel::kNumbers> numbers{};

  void read(std::istream& words) {
    words >> noise;
    for (double& number : numbers) words >> number;
    Sample::read(words);
  }
};

/// Adds noise of a spectrum along one direction for each vertex.
Mesh with_noise(const Mesh& original, const Surface& surface, const NoiseSpectrum& spectrum,
                const std::vector<Vec3>& directions, std::mt19937_64& random) {
  ThreadTeam alone(1);
  const std::vector<double> noise =
      spectrum.sample(LazyWalk(surface, alone), original.positions.size(), static_cast<std::uint32_t>(random()));
  Mesh noisy = original;
  for (std::size_t v = 0; v < noise.size(); ++v) {
    noisy.positions[v] += surface.unit * noise[v] * direction(directions[v]);
  }
  return noisy;
}

/// That of depth cameras: along an axis, of 0.2 to 1 edge lengths, and half of the time rounded to steps.
Mesh with_depth_noise(const Mesh& original, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const Topology topology = build_topology(original);
  const Surface surface(original, topology);
  const double level = 0.2 * std::pow(5.0, unit(random)), white = 0.4 * unit(random);
  const auto center = static_cast<std::size_t>(1 + static_cast<int>(4.999 * unit(random)));
  NoiseSpectrum spectrum;
  spectrum.variances[0] = white * level * level;
  for (std::size_t k = center; k < center + 3; ++k) spectrum.variances[k] = (1 - white) / 3 * level * level;
  const Vec3 axis = Vec3(unit(random) - 0.5, unit(random) - 0.5, 0.5).normalized();
  Mesh noisy = with_noise(original, surface, spectrum, std::vector<Vec3>(original.positions.size(), axis), random);
  const double step = surface.unit * level * (0.5 + 2 * unit(random));
  if (unit(random) < 0.5) return noisy;
  for (Vec3& position : noisy.positions) {
    const double depth = position.dot(axis);
    position += (step * std::round(depth / step) - depth) * axis;
  }
  return noisy;
}

/// Noise of one wavelength or of several, of 0.06 to 0.72 edge lengths, along the normals or, as that of depth cameras,
/// along an axis.
Mesh with_scanner_noise(const Mesh& original, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const Topology topology = build_topology(original);
  const Surface surface(original, topology);
  const double level = 0.06 * std::pow(12.0, unit(random));
  const double white = unit(random) < 0.6 ? 0 : 0.4 * std::pow(unit(random), 2);
  const int center = 1 + static_cast<int>(6.999 * unit(random)), waves = 1 + static_cast<int>(4 * unit(random));
  std::array<double, NoiseSpectrum::kSteps.size()> shares{};
  if (unit(random) < 0.5) {
    shares[static_cast<std::size_t>(center)] = 1;
  } else {
    for (int wave = 0; wave < waves; ++wave) {
      const int part = std::clamp(center + static_cast<int>(5 * unit(random)) - 2, 1, 7);
      shares[static_cast<std::size_t>(part)] += 0.2 + unit(random);
    }
  }
  const double sum = std::accumulate(shares.begin(), shares.end(), 0.0);
  NoiseSpectrum spectrum;
  for (std::size_t k = 0; k < shares.size(); ++k) spectrum.variances[k] = level * level * (1 - white) * shares[k] / sum;
  spectrum.variances[0] += level * level * white;
  std::vector<Vec3> directions = unit_vertex_normals(original, topology);
  if (unit(random) < 0.2) std::ranges::fill(directions, Vec3(unit(random), unit(random), 1));
  return with_noise(original, surface, spectrum, directions, random);
}

Mesh stretched(const Mesh& original, std::mt19937_64& random) {
  std::uniform_real_distribution<double> factor(0.6, 1.6);
  const Vec3 factors(factor(random), factor(random), factor(random));
  Mesh mesh = original;
  for (Vec3& position : mesh.positions) position = position.cwiseProduct(factors);
  return mesh;
}

void print_measured(const std::string& name, const std::string& family, std::string_view kind, const Mesh& original,
                    const Mesh& noisy) {
  ThreadTeam team(1);
  const Topology topology = build_topology(noisy);
  const Surface surface(noisy, topology);
  const FlatMesh mesh(surface);
  const Solve solve = [&](const SolveRequest& request) {
    GraduatedDescent descent(request.mesh, request.measured, request.options, request.precisions, request.latent, team);
    if (!request.start.empty()) descent.resume(request.first_stage, {request.start.begin(), request.start.end()});
    return descent.run();
  };
  const NoiseSpectrum spectrum = *find_correlated_noise(surface, true, team);
  ScanPath path(surface, mesh, spectrum, 1, solve, team);
  ScanTrial trial = try_scan(path, mesh, spectrum);
  for (std::size_t k = kTellingWeights; k < kScanWeights.size(); ++k) {
    trial.positions.push_back(path.solved(kScanWeights[k], trial.positions.back()).positions);
  }
  std::vector<double> errors;
  for (const FlatVectors& positions : trial.positions) errors.push_back(normal_error_deg(original, positions));
  ChoiceReport report;
  errors.push_back(normal_error_deg(original, choose_and_solve(surface, mesh, {}, {}, solve, report).positions));
  fmt::print("{} {} {} {} {} {}\n", kind,
             fmt::join(OddsModel::numbers_of(std::span(spectrum.bands).first<kTellingBands>()), " "), name, family,
             fmt::join(trial.features, " "), fmt::join(errors, " "));
  std::fflush(stdout);
}

void measure_model(const std::string& name, const std::string& family, const Mesh& original, std::size_t number) {
  constexpr std::size_t kWithout = 3, kIndependentPairs = 4, kCorrelatedPairs = 7, kDepthPairs = 3;
  if (original.positions.size() < kFewestOfScan || original.positions.size() > kMostOfScan) return;
  std::mt19937_64 random(77 * number + 1);
  for (std::size_t k = 0; k < kWithout; ++k) {
    const Mesh mesh = k > 0 ? stretched(original, random) : original;
    print_measured(name, family, "none", mesh, mesh);
  }
  const std::span noises = training_noises();
  for (std::size_t k = 0; k < kIndependentPairs; ++k) {
    const auto& [noise, level] = noises[(7 * number + 5 * k) % noises.size()];
    print_measured(name, family, word_of(noise), original, add_noise_of_kind(original, noise, level, random()));
  }
  for (std::size_t k = 0; k < kCorrelatedPairs; ++k) {
    print_measured(name, family, "correlated", original, with_scanner_noise(original, random));
  }
  for (std::size_t k = 0; k < kDepthPairs; ++k) {
    print_measured(name, family, "depth", original, with_depth_noise(original, random));
  }
}

/// The weight with the smallest expected error, or the setting for independent noise.
std::size_t pick(const ScanSample& sample, const ScanModel& model) {
  const ScanErrors errors = model.expected(sample.features);
  const auto best = static_cast<std::size_t>(std::min_element(errors.begin(), errors.end() - 1) - errors.begin());
  return errors[kIndependent] - errors[best] < kLeastGainOfScan ? kIndependent : best;
}

double gain_of_scan(const ScanSample& sample) {
  return log_error(sample.errors[kIndependent]) -
         log_error(*std::min_element(sample.errors.begin(), sample.errors.end() - 1));
}

/// Newton's method. Samples weigh as much as there is to gain, those without gain alike.
OddsModel fitted_odds(const std::vector<const ScanSample*>& samples) {
  constexpr double kWorthwhile = 0.1, kWeightWithout = 0.3, kPenalty = 1;
  OddsModel model;
  standardise(samples, &ScanSample::numbers, model);
  constexpr auto kTerms = static_cast<Eigen::Index>(model.factors.size());
  using Terms = Eigen::Matrix<double, kTerms, 1>;
  Terms factors = Terms::Zero();
  constexpr int kSteps = 30;
  for (int step = 0; step < kSteps; ++step) {
    Terms slope = -kPenalty * factors;
    Eigen::Matrix<double, kTerms, kTerms> curvature = Eigen::Matrix<double, kTerms, kTerms>::Identity() * kPenalty;
    for (const ScanSample* sample : samples) {
      const auto numbers = model.terms_of(sample->numbers);
      const Terms terms = Eigen::Map<const Terms>(numbers.data());
      const double gain = gain_of_scan(*sample), odds = 1 / (1 + std::exp(-factors.dot(terms)));
      const double weight = gain > kWorthwhile ? gain : kWeightWithout;
      slope += weight * ((gain > kWorthwhile ? 1 : 0) - odds) * terms;
      curvature += weight * odds * (1 - odds) * terms * terms.transpose();
    }
    factors += curvature.ldlt().solve(slope);
  }
  Eigen::Map<Terms>(model.factors.data()) = factors;
  return model;
}

/// What is lost and won by kind of noise, families left out.
void report_cost(const std::vector<ScanSample>& samples, const OddsModel& odds) {
  struct Sums {
    double count = 0, over_hindsight = 0, over_independent = 0, scans = 0, tried = 0;
  };
  std::map<std::string, Sums> sums;
  visit_left_out(samples, fitted<ScanModel, ScanSample>, [&](const ScanSample& sample, const ScanModel& model) {
    const bool tried = odds.log_odds(sample.numbers) > 0;
    const std::size_t chosen = tried ? pick(sample, model) : kIndependent;
    Sums& sum = sums[sample.noise];
    ++sum.count;
    sum.over_hindsight += loss(sample, chosen);
    sum.over_independent += loss(sample, chosen) - loss(sample, kIndependent);
    sum.scans += chosen == kIndependent ? 0 : 1;
    sum.tried += tried ? 1 : 0;
  });
  for (const auto& [kind, sum] : sums) {
    fmt::print(stderr,
               "{}: {} pairs, tried {:.3f}, taken for scans {:.3f}; over hindsight {:.3f}, over independent {:.3f}\n",
               kind, sum.count, sum.tried / sum.count, sum.scans / sum.count, std::exp(sum.over_hindsight / sum.count),
               std::exp(sum.over_independent / sum.count));
  }
}

}  // namespace

void measure_scans(const Part& of) {
  std::vector<PairRecipe> recipes = recipes_of(PairSet::kTraining);
  std::ranges::copy(recipes_of(PairSet::kDevelopment), std::back_inserter(recipes));
  std::set<std::string> seen;
  std::size_t number = 0;
  for (PairRecipe recipe : recipes) {
    if (recipe.noise == Noise::kMeasured || !seen.insert(recipe.model).second || number++ % of.parts != of.part)
      continue;
    recipe.noise = Noise::kNormal;
    recipe.level = 0;
    if (const auto pair = build_pair(recipe, {})) measure_model(recipe.model, recipe.family, pair->original, number);
  }
  if (of.models.empty()) return;
  std::vector<fs::path> models;
  for (const auto& entry : fs::directory_iterator(of.models)) models.push_back(entry.path());
  std::ranges::sort(models);
  for (const fs::path& path : models) {
    if (number++ % of.parts != of.part) continue;
    const std::string name = path.stem().string();
    const Mesh original = decode_mesh(test::read_file(path), format_from_filename(path.string())).mesh;
    measure_model(name, name.substr(0, name.rfind('_')), original, number);
  }
}

void write_scan_table(const std::vector<std::string>& files) {
  const auto samples = read_samples<ScanSample>(files);
  const auto all = pointers_to(samples);
  const OddsModel odds = fitted_odds(all);
  report_cost(samples, odds);
  print_table_head("core/choice/scan_error.h");
  fmt::print("inline constexpr OddsModel kFittedOdds{{{{{}}}, {{{}}}, {{{}}}}};\n", row_of(odds.means),
             row_of(odds.deviations), row_of(odds.factors));
  print_table(fitted<ScanModel>(all), "ScanModel", "Scan");
}

}  // namespace crease::quality
