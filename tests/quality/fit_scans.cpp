#include "tests/quality/fit_scans.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <iterator>
#include <random>
#include <set>

#include "core/choice/choice.h"
#include "core/choice/ranking.h"
#include "core/choice/scan_error.h"
#include "core/choice/scan_trial.h"
#include "core/io/decode.h"
#include "tests/quality/depth_camera.h"
#include "tests/quality/error_fit.h"
#include "tests/quality/fused_scan.h"
#include "tests/quality/pairs.h"
#include "tests/support/meshes.h"

namespace crease::quality {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFewestOfScan = 1000, kMostFacesOfPair = 13'000, kIndependent = kScanSettings.size();

/// Of measuring every model. Those of folders are many, and mostly parts.
constexpr std::size_t kRounds = 4, kRoundsOfParts = 2;
/// Of scanning every model; most scans are too small or too large.
constexpr std::size_t kRoundsOfFused = 10, kRoundsOfFusedParts = 4, kFirstSeedOfFused = 1'000'000;

struct ScanSample : Sample<ScanModel> {
  std::string noise;  ///< a word of noise_models.h, "none", or "view" or "fused", perhaps with "-white" or "-none"
  ScanOdds::Numbers numbers{};

  void read(std::istream& words) {
    words >> noise;
    for (double& number : numbers) words >> number;
    Sample::read(words);
  }
};

/// Measures the patches in place of a mesh that is too large to be tried as a whole.
void print_measured(const TrainingModel& model, std::string_view kind, const Mesh& original, const Mesh& noisy) {
  if (noisy.positions.size() < kFewestOfScan) return;
  ThreadTeam team(1);
  const Topology topology = build_topology(noisy);
  const Surface surface(noisy, topology);
  const NoiseSpectrum spectrum = *find_correlated_noise(surface, true, team);
  const std::optional<TrialPatches> trial = cut_for_trials(surface, {});
  const Mesh tried = trial ? trial->patches.mesh : noisy, truth = trial ? part_of(original, trial->patches) : original;
  const Topology topology_tried = build_topology(tried);
  const Surface surface_tried(tried, topology_tried);
  const FlatMesh mesh(surface_tried);
  const Solve solve = solve_with(team);
  const ScanSolver solver(mesh, {}, spectrum, solve, team);
  std::vector<double> errors;
  for (const Setting& setting : kScanSettings) {
    errors.push_back(normal_error_deg(truth, solver.solved(setting, true).positions));
  }
  ChoiceReport report;
  errors.push_back(
      normal_error_deg(truth, choose_and_solve(surface_tried, mesh, {}, {}, solve, report, team).positions));
  fmt::print("{} {:.5g} {} {} {:.5g} {:.4f}\n", kind, fmt::join(scan_numbers(spectrum), " "), model.name, model.family,
             fmt::join(try_scan(solver, mesh, spectrum), " "), fmt::join(errors, " "));
  std::fflush(stdout);
}

/// What a depth camera sees of the model; a quarter of the time without noise, or with noise that is not correlated.
void measure_view(const TrainingModel& model, const Mesh& original, std::mt19937_64& random) {
  constexpr double kWithout = 0.12, kWhite = 0.24;
  const DepthCamera camera = random_camera(random);
  DepthNoise noise = random_depth_noise(random);
  const double share = std::uniform_real_distribution<double>(0, 1)(random);
  std::string_view kind = "view";
  if (share < kWithout) {
    noise = {};
    kind = "view-none";
  } else if (share < kWhite) {
    noise.fine_width = noise.broad_share = noise.step = 0;
    kind = "view-white";
  }
  const auto view = take_depth_view(original, camera, noise, random());
  if (view && view->noisy.triangles.size() <= kMostFacesOfPair) {
    print_measured(model, kind, view->original, view->noisy);
  }
}

/// A scan that is fused of several views; a quarter of the time it is the model as the scan samples it, without noise
/// or with noise that is not correlated.
void measure_fused(const TrainingModel& model, const Mesh& original, std::mt19937_64& random) {
  constexpr double kWithout = 0.14, kWhite = 0.26;
  const FusedScan settings = random_fused_scan(random);
  const double share = std::uniform_real_distribution<double>(0, 1)(random);
  const auto scan = take_fused_scan(original, settings, random());
  if (!scan) return;
  if (share < kWithout) {
    print_measured(model, "fused-none", scan->original, scan->original);
  } else if (share < kWhite) {
    const double level = 0.05 * std::pow(10.0, std::uniform_real_distribution<double>(0, 1)(random));
    print_measured(model, "fused-white", scan->original,
                   add_noise_of_kind(scan->original, Noise::kNormal, level, random()));
  } else {
    print_measured(model, "fused", scan->original, scan->noisy);
  }
}

bool is_measured_whole(const Mesh& original) {
  constexpr std::size_t kFewestOfWhole = 1500;
  return original.positions.size() >= kFewestOfWhole && original.triangles.size() <= kMostFacesOfPair;
}

void measure_independent(const TrainingModel& model, const Mesh& original, std::mt19937_64& random) {
  const std::span noises = training_noises();
  const auto& [noise, level] = noises[random() % noises.size()];
  print_measured(model, word_of(noise), original, add_noise_of_kind(original, noise, level, random()));
}

/// The model itself with noise that is correlated, independent, or none.
void measure_whole(const TrainingModel& model, const Mesh& original, std::mt19937_64& random) {
  constexpr double kWithout = 0.2, kIndependentShare = 0.45;
  const double share = std::uniform_real_distribution<double>(0, 1)(random);
  if (share < kWithout) {
    print_measured(model, "none", original, original);
  } else if (share < kIndependentShare) {
    measure_independent(model, original, random);
  } else {
    print_measured(model, "correlated", original, with_waves(original, random));
  }
}

/// The setting with the smallest expected error, or that for independent noise.
std::size_t pick(const ScanSample& sample, const ScanModel& model) {
  const ScanErrors errors = model.expected(sample.features);
  return counts_as_scan(model, sample.features) ? best_of(std::span(errors).first<kIndependent>()) : kIndependent;
}

double gain_of_scan(const ScanSample& sample) {
  return log_error(sample.errors[kIndependent]) -
         log_error(*std::min_element(sample.errors.begin(), sample.errors.end() - 1));
}

/// Samples weigh as much as there is to gain, those without gain alike.
ScanOdds fitted_scan_odds(const std::vector<const ScanSample*>& samples, bool keeps) {
  constexpr double kWorthwhile = 0.1, kWeightWithout = 0.3;
  ScanOdds model;
  if (keeps) {
    model = kScanOdds;
  } else {
    standardise(samples, &ScanSample::numbers, model);
  }
  fit_odds(model, samples, &ScanSample::numbers, [](const ScanSample& sample) {
    const double gain = gain_of_scan(sample);
    return gain > kWorthwhile ? Verdict{true, gain} : Verdict{false, kWeightWithout};
  });
  return model;
}

/// The pairs that the present table was fitted to.
std::vector<ScanSample> known_samples() {
  auto samples = samples_known_to<ScanSample>(kFittedScanModel);
  for (ScanSample& sample : samples) {
    sample.noise = "known";
    sample.numbers = scan_numbers(spectrum_of(sample.features));
  }
  return samples;
}

/// What is lost and won by kind of noise, families left out.
void report_cost(const std::vector<ScanSample>& samples, const ScanOdds& odds, const ScanModel* standards) {
  struct Sums {
    double count = 0, over_hindsight = 0, over_independent = 0, scans = 0, tried = 0;
  };
  std::map<std::string, Sums> sums;
  const auto fit = [&](const std::vector<const ScanSample*>& some) { return fitted<ScanModel>(some, standards); };
  visit_left_out(samples, fit, [&](const ScanSample& sample, const ScanModel& model) {
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

std::vector<TrainingModel> training_models(std::initializer_list<PairSet> sets,
                                           const std::vector<std::string>& folders) {
  std::vector<TrainingModel> models;
  std::set<std::string> seen;
  for (const PairSet set : sets) {
    for (PairRecipe recipe : recipes_of(set)) {
      if (recipe.noise == Noise::kMeasured || !seen.insert(recipe.model).second) continue;
      recipe.noise = Noise::kNormal;
      recipe.level = 0;
      models.push_back({recipe.model, recipe.family, false, [recipe]() -> std::optional<Mesh> {
                          auto pair = build_pair(recipe, {});
                          if (!pair) return std::nullopt;
                          return std::move(pair->original);
                        }});
    }
  }
  for (const std::string& folder : folders) {
    for (const ModelFile& file : model_files(folder)) {
      models.push_back({file.name(), file.family(), true, [file] { return file.read(); }});
    }
  }
  return models;
}

Mesh with_waves(const Mesh& original, std::mt19937_64& random) {
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
  ThreadTeam alone(1);
  const std::vector<double> noise =
      spectrum.sample(LazyWalk(surface, alone), original.positions.size(), static_cast<std::uint32_t>(random()));
  const std::vector<Vec3> normals = unit_vertex_normals(original, topology);
  Mesh noisy = original;
  for (std::size_t v = 0; v < noise.size(); ++v) noisy.positions[v] += surface.unit * noise[v] * normals[v];
  return noisy;
}

Mesh part_of(const Mesh& mesh, const Patches& patches) {
  Mesh part;
  part.triangles = patches.mesh.triangles;
  for (const Index v : patches.vertices) part.positions.push_back(mesh.positions[v]);
  return part;
}

Mesh ModelFile::read() const { return decode_mesh(test::read_file(path), format_from_filename(path.string())).mesh; }

std::vector<ModelFile> model_files(const std::string& folder) {
  std::vector<ModelFile> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back({entry.path()});
  std::ranges::sort(files, {}, &ModelFile::path);
  return files;
}

void measure_scans(const Part& of) {
  const std::vector<TrainingModel> models = training_models({PairSet::kTraining, PairSet::kDevelopment}, of.models);
  const auto is_asked_for = [&](std::string_view kind) { return of.kind.empty() || of.kind == kind; };
  for (std::size_t round = 0; round < kRoundsOfFused; ++round) {
    for (std::size_t k = of.part; k < models.size(); k += of.parts) {
      const TrainingModel& model = models[k];
      const bool measures = round < (model.is_of_folder ? kRoundsOfParts : kRounds),
                 fuses = round < (model.is_of_folder ? kRoundsOfFusedParts : kRoundsOfFused) && is_asked_for("fused");
      const std::optional<Mesh> original = measures || fuses ? model.load() : std::nullopt;
      if (!original) continue;
      if (fuses) {
        std::mt19937_64 random(kFirstSeedOfFused + kRoundsOfFused * k + round);
        measure_fused(model, *original, random);
      }
      std::mt19937_64 random(kRounds * k + round + 1);
      if (measures && is_asked_for("views")) measure_view(model, *original, random);
      if (!measures || !is_asked_for("whole") || !is_measured_whole(*original)) continue;
      measure_whole(model, *original, random);
      measure_independent(model, *original, random);
    }
  }
}

void write_scan_table(const std::vector<std::string>& files, bool keeps) {
  auto samples = read_samples<ScanSample>(files);
  if (keeps) std::ranges::move(known_samples(), std::back_inserter(samples));
  const auto all = pointers_to(samples);
  const ScanModel* standards = keeps ? &kFittedScanModel : nullptr;
  const ScanOdds odds = fitted_scan_odds(all, keeps);
  report_cost(samples, odds, standards);
  print_table_head("core/choice/scan_error.h");
  print_odds(odds, "ScanOdds", "kFittedScanOdds");
  print_table(fitted<ScanModel>(all, standards), "ScanModel", "Scan");
}

}  // namespace crease::quality
