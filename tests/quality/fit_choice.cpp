// Fits core/choice/expected_error_table.h: fit_choice --help

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <numeric>
#include <span>
#include <sstream>

#include "core/choice/evidence.h"
#include "core/choice/expected_error.h"
#include "core/choice/features.h"
#include "core/io/decode.h"
#include "core/measure/measure.h"
#include "tests/quality/pairs.h"
#include "tests/support/meshes.h"

namespace crease::quality {
namespace {

constexpr std::size_t kSettingCount = kSettings.size(), kMostFaces = 40'000, kFewestVertices = 100;
constexpr double kLeastErrorDeg = 0.1;  ///< errors below it count as this

/// What is learnt from: a pair whose noise is not correlated.
struct Sample {
  std::string pair, family;
  Features features{};
  SettingErrors errors{};  ///< mean angle between normals in degrees
};

double normal_error_deg(const Mesh& original, const FlatVectors& positions) {
  Mesh moved = original;
  for (std::size_t v = 0; v < moved.positions.size(); ++v) {
    const auto p = vector_at(positions, v);
    moved.positions[v] = Vec3(p[0], p[1], p[2]);
  }
  return measure(original, moved).mean_normal_error_deg;
}

Sample measured(const Pair& pair, const std::string& family) {
  const Topology topology = build_topology(pair.noisy);
  const Surface surface(pair.noisy, topology);
  const FlatMesh mesh(surface);
  ThreadTeam team(1);
  const Solve solve = [&](const SolveRequest& request) {
    return GraduatedDescent(request.mesh, request.measured, request.options, request.precisions, request.latent, team)
        .run();
  };
  const FirstSight sight = look_at(surface, std::nullopt, std::nullopt);
  const Evidence evidence = gather_evidence(mesh, sight, {}, {}, solve, false);
  Sample sample{pair.name, family, features_of(mesh, evidence), {}};
  for (std::size_t i = 0; i < kSettingCount; ++i) {
    const GraduatedOptions options = evidence.sight.options(kSettings[i], evidence.variance, false);
    const GraduatedResult result = solve({mesh, mesh.measured, options, evidence.precisions, {}});
    sample.errors[i] = normal_error_deg(pair.original, result.positions);
  }
  return sample;
}

void print_measured(const Pair& pair, const std::string& family) {
  if (pair.original.triangles.size() > kMostFaces || pair.original.positions.size() < kFewestVertices) return;
  const Sample sample = measured(pair, family);
  fmt::print("{} {} {} {}\n", sample.pair, sample.family, fmt::join(sample.features, " "),
             fmt::join(sample.errors, " "));
  std::fflush(stdout);
}

/// What to measure: every so manieth item, so that several processes share the work.
struct Part {
  std::size_t part = 0, parts = 1;
  std::string meshes, models;  ///< folders
};

void measure_pairs(const Part& of) {
  std::vector<PairRecipe> recipes = recipes_of(PairSet::kTraining);
  for (const PairRecipe& recipe : recipes_of(PairSet::kDevelopment)) {
    if (recipe.noise != Noise::kCorrelated && recipe.level > 0) recipes.push_back(recipe);
  }
  for (std::size_t i = of.part; i < recipes.size(); i += of.parts) {
    if (const std::optional<Pair> pair = build_pair(recipes[i], of.meshes)) print_measured(*pair, recipes[i].family);
  }
}

/// Pairs from the models of a folder. Those named alike but for a number are a family.
void measure_models(const Part& of) {
  constexpr std::uint64_t kSeed = 5, kPairsOfModel = 4;
  std::vector<std::filesystem::path> models;
  for (const auto& entry : std::filesystem::directory_iterator(of.models)) models.push_back(entry.path());
  std::ranges::sort(models);
  const std::span noises = training_noises();
  for (std::size_t i = of.part; i < models.size(); i += of.parts) {
    const std::string name = models[i].stem().string();
    const Mesh original = decode_mesh(test::read_file(models[i]), format_from_filename(models[i].string())).mesh;
    for (std::uint64_t k = 0; k < kPairsOfModel; ++k) {
      const auto& [noise, level] = noises[(7 * i + 5 * k) % noises.size()];
      const Mesh noisy = add_noise_of_kind(original, noise, level, kSeed + k);
      print_measured({fmt::format("{}-{}-{}", name, word_of(noise), level), noise, level, original, noisy},
                     name.substr(0, name.rfind('_')));
    }
  }
}

std::vector<Sample> read(const std::vector<std::string>& files) {
  std::vector<Sample> samples;
  for (const std::string& name : files) {
    std::ifstream file(name);
    for (std::string line; std::getline(file, line);) {
      std::istringstream words(line);
      Sample sample;
      words >> sample.pair >> sample.family;
      for (double& feature : sample.features) words >> feature;
      for (double& error : sample.errors) words >> error;
      if (!words) throw std::runtime_error(name + ": a row is not of these features and settings: " + line);
      samples.push_back(sample);
    }
  }
  return samples;
}

/// A model whose landmarks it owns.
struct Fit {
  ErrorModel model;
  std::vector<Landmark> landmarks;
};

double log_error(double error) { return std::log(std::max(kLeastErrorDeg, error)); }

void standardise(const std::vector<const Sample*>& samples, ErrorModel& model) {
  const auto count = static_cast<double>(samples.size());
  for (std::size_t k = 0; k < kFeatures; ++k) {
    double squares = 0;
    for (const Sample* sample : samples) model.means[k] += sample->features[k] / count;
    for (const Sample* sample : samples) squares += std::pow(sample->features[k] - model.means[k], 2) / count;
    model.deviations[k] = std::sqrt(squares) + 1e-6;
  }
}

/// Kernel ridge regression of the logarithms of the errors over the smallest of their pair.
Fit fitted(const std::vector<const Sample*>& samples) {
  constexpr double kPenalty = 0.1;
  const auto count = static_cast<Eigen::Index>(samples.size());
  Fit fit;
  standardise(samples, fit.model);
  Eigen::MatrixXd errors(count, static_cast<Eigen::Index>(kSettingCount)), alike(count, count);
  for (Eigen::Index s = 0; s < count; ++s) {
    const Sample& sample = *samples[static_cast<std::size_t>(s)];
    fit.landmarks.push_back({fit.model.standardised(sample.features), {}});
    const double least = log_error(*std::ranges::min_element(sample.errors));
    for (std::size_t i = 0; i < kSettingCount; ++i) {
      const double error = std::min(ErrorModel::kWorst, log_error(sample.errors[i]) - least);
      errors(s, static_cast<Eigen::Index>(i)) = error;
      fit.model.mean_errors[i] += error / static_cast<double>(count);
    }
    for (Eigen::Index other = 0; other <= s; ++other) {
      alike(s, other) =
          likeness(fit.landmarks.back().features, fit.landmarks[static_cast<std::size_t>(other)].features);
    }
  }
  for (std::size_t i = 0; i < kSettingCount; ++i) {
    errors.col(static_cast<Eigen::Index>(i)).array() -= fit.model.mean_errors[i];
  }
  alike.diagonal().array() += kPenalty;
  const Eigen::MatrixXd influence = alike.selfadjointView<Eigen::Lower>().llt().solve(errors);
  for (Eigen::Index s = 0; s < count; ++s) {
    for (std::size_t i = 0; i < kSettingCount; ++i) {
      fit.landmarks[static_cast<std::size_t>(s)].influence[i] = influence(s, static_cast<Eigen::Index>(i));
    }
  }
  fit.model.landmarks = fit.landmarks;
  return fit;
}

/// Logarithm of the error of a setting over that of the best one.
double loss(const Sample& sample, std::size_t setting) {
  return log_error(sample.errors[setting]) - log_error(*std::ranges::min_element(sample.errors));
}

std::size_t pick(const Sample& sample, const ErrorModel& model) {
  const SettingErrors expected = expected_log_errors(sample.features, model);
  return static_cast<std::size_t>(std::ranges::min_element(expected) - expected.begin());
}

/// The mean loss of each family, with a tenth of the families left out of the fit at a time.
std::map<std::string, std::vector<double>> losses_left_out(const std::vector<Sample>& samples) {
  constexpr std::size_t kFolds = 10;
  std::map<std::string, std::size_t> folds;
  for (const Sample& sample : samples) folds.emplace(sample.family, folds.size() % kFolds);
  std::map<std::string, std::vector<double>> losses;
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    std::vector<const Sample*> others;
    for (const Sample& sample : samples) {
      if (folds.at(sample.family) != fold) others.push_back(&sample);
    }
    const Fit fit = fitted(others);
    for (const Sample& sample : samples) {
      if (folds.at(sample.family) == fold) losses[sample.family].push_back(loss(sample, pick(sample, fit.model)));
    }
  }
  return losses;
}

/// What the choice costs against the best setting in hindsight.
void report_cost(const std::vector<Sample>& samples, const ErrorModel& model) {
  constexpr double kDear = 0.2;
  const auto count = static_cast<double>(samples.size());
  double fitted = 0, left_out = 0;
  for (const Sample& sample : samples) fitted += loss(sample, pick(sample, model)) / count;
  for (const auto& [family, losses] : losses_left_out(samples)) {
    const double sum = std::accumulate(losses.begin(), losses.end(), 0.0);
    left_out += sum / count;
    const double mean = sum / static_cast<double>(losses.size());
    if (mean > kDear) fmt::print(stderr, "  family {}: {:.3f}\n", family, std::exp(mean));
  }
  fmt::print(stderr, "{} pairs. Over the best setting in hindsight: {:.3f}, families left out {:.3f}\n", samples.size(),
             std::exp(fitted), std::exp(left_out));
  for (std::size_t i = 0; i < kSettingCount; ++i) {
    double always = 0;
    for (const Sample& sample : samples) always += loss(sample, i) / count;
    const auto best = std::ranges::count_if(samples, [&](const Sample& sample) { return loss(sample, i) == 0; });
    fmt::print(stderr, "  always {} {}: {:.3f}; best for {}\n", kSettings[i].family.name, kSettings[i].weight,
               std::exp(always), best);
  }
}

template <typename Numbers>
std::string row_of(const Numbers& numbers) {
  return fmt::format("{{{:.5g}}}", fmt::join(numbers, ", "));
}

void write_table(const std::vector<Sample>& samples) {
  std::vector<const Sample*> all;
  for (const Sample& sample : samples) all.push_back(&sample);
  const Fit fit = fitted(all);
  report_cost(samples, fit.model);
  fmt::print(
      "#pragma once\n\n#include \"core/choice/expected_error.h\"\n\nnamespace crease {{\n\n"
      "// Written by fit_choice in tests/quality.\n// clang-format off\n\n"
      "inline constexpr Features kFeatureMeans{{{}}};\ninline constexpr Features kFeatureDeviations{{{}}};\n"
      "inline constexpr SettingErrors kMeanErrors{{{}}};\n"
      "inline constexpr std::array<Landmark, {}> kLandmarks{{{{\n",
      row_of(fit.model.means), row_of(fit.model.deviations), row_of(fit.model.mean_errors), fit.landmarks.size());
  for (const Landmark& landmark : fit.landmarks) {
    fmt::print("{{{{{{{}}}}},{{{{{:.3g}}}}}}},\n", fmt::join(landmark.features, ","),
               fmt::join(landmark.influence, ","));
  }
  fmt::print("}}}};\n\n// clang-format on\n\n}}  // namespace crease\n");
}

}  // namespace
}  // namespace crease::quality

int main(int count, char** arguments) try {
  CLI::App app{"Fits the automatic choice: solves every setting on the training pairs, and regresses their errors"};
  app.require_subcommand(1);
  crease::quality::Part of;
  CLI::App* measure = app.add_subcommand("measure", "Prints features and errors, a pair per line");
  measure->add_option("--part", of.part, "Number of the part, from 0");
  measure->add_option("--parts", of.parts, "Take every so manieth pair or model")->check(CLI::PositiveNumber);
  measure->add_option("--meshes", of.meshes, "Folder of pairs with measured noise");
  measure->add_option("--models", of.models, "Measure the models of this folder in place of the training pairs")
      ->check(CLI::ExistingDirectory);
  std::vector<std::string> files;
  CLI::App* table =
      app.add_subcommand("table", "Prints core/choice/expected_error_table.h, and the cost of the choice to stderr");
  table->add_option("files", files, "What measure printed")->required()->check(CLI::ExistingFile);
  CLI11_PARSE(app, count, arguments);
  if (measure->parsed()) (of.models.empty() ? crease::quality::measure_pairs : crease::quality::measure_models)(of);
  if (table->parsed()) crease::quality::write_table(crease::quality::read(files));
} catch (const std::exception& error) {
  std::fputs((std::string(error.what()) + "\n").c_str(), stderr);
  return 1;
}
