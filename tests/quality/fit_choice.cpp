// Fits the tables of core/choice: fit_choice --help

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <exception>
#include <map>
#include <numeric>
#include <span>

#include "tests/quality/error_fit.h"
#include "tests/quality/fit_clean.h"
#include "tests/quality/fit_direction.h"
#include "tests/quality/fit_regressions.h"
#include "tests/quality/fit_scans.h"
#include "tests/quality/fit_second_look.h"
#include "tests/quality/fit_weights.h"
#include "tests/quality/known_upload.h"
#include "tests/quality/pairs.h"

namespace crease::quality {
namespace {

constexpr std::size_t kFewestVertices = 100;

/// Of large meshes, what is tried in their place.
SettingSample measured(const Pair& pair, const std::string& family) {
  const Topology topology = build_topology(pair.noisy);
  const Surface surface(pair.noisy, topology);
  ThreadTeam team(1);
  const Solve solve = solve_with(team);
  const KnownUpload known(surface, look_at(surface, std::nullopt, std::nullopt, team), solve);
  const FlatMesh& mesh = known.mesh;
  const Evidence& evidence = known.evidence;
  const Mesh original = known.trial ? part_of(pair.original, known.trial->patches) : pair.original;
  SettingSample sample;
  sample.pair = pair.name;
  sample.family = family;
  sample.features = known.features;
  std::vector<FlatVectors> normals{evidence.reference.result.vertex_normals};
  for (std::size_t i = 0; i < kSettings.size(); ++i) {
    const GraduatedOptions options = evidence.sight.options(kSettings[i], evidence.variance, false);
    Candidate candidate;
    candidate.result = solve({mesh, mesh.measured, options, evidence.precisions, {}});
    score_residuals(candidate, mesh, evidence.precisions, false);
    sample.errors[i] = normal_error_deg(original, candidate.result.positions);
    sample.looks[i] = look_of(features_of(mesh, evidence, candidate));
    normals.push_back(std::move(candidate.result.vertex_normals));
  }
  auto angle = sample.angles.begin();
  for (std::size_t i = 0; i < normals.size(); ++i) {
    for (std::size_t j = i + 1; j < normals.size(); ++j) *angle++ = mean_angle_deg(normals[i], normals[j]);
  }
  return sample;
}

void print_measured(const Pair& pair, const std::string& family) {
  if (pair.original.positions.size() < kFewestVertices) return;
  const SettingSample sample = measured(pair, family);
  fmt::print("{} {} {:.6g} {:.5g}", sample.pair, sample.family, fmt::join(sample.features, " "),
             fmt::join(sample.errors, " "));
  for (const Look& look : sample.looks) fmt::print(" {:.5g}", fmt::join(look, " "));
  fmt::print(" {:.4g}\n", fmt::join(sample.angles, " "));
  std::fflush(stdout);
}

void measure_pairs(const Part& of) {
  std::vector<PairRecipe> recipes = recipes_of(PairSet::kTraining);
  for (const PairRecipe& recipe : recipes_of(PairSet::kDevelopment)) {
    const bool is_independent =
        recipe.noise != Noise::kCorrelated && recipe.noise != Noise::kDepth && recipe.noise != Noise::kFused;
    if (is_independent && recipe.level > 0) recipes.push_back(recipe);
  }
  for (std::size_t i = of.part; i < recipes.size(); i += of.parts) {
    if (const std::optional<Pair> pair = build_pair(recipes[i], of.meshes)) print_measured(*pair, recipes[i].family);
  }
}

/// Pairs from the models of a folder.
void measure_models(const std::string& folder, const Part& of) {
  constexpr std::uint64_t kSeed = 5, kPairsOfModel = 4;
  const std::vector<ModelFile> models = model_files(folder);
  const std::span noises = training_noises();
  for (std::size_t i = of.part; i < models.size(); i += of.parts) {
    const Mesh original = models[i].read();
    for (std::uint64_t k = 0; k < kPairsOfModel; ++k) {
      const auto& [noise, level] = noises[(7 * i + 5 * k) % noises.size()];
      const Mesh noisy = add_noise_of_kind(original, noise, level, kSeed + k);
      print_measured({fmt::format("{}-{}-{}", models[i].name(), word_of(noise), level), noise, level, original, noisy},
                     models[i].family());
    }
  }
}

std::size_t pick(const SettingSample& sample, const SettingModel& model) {
  const SettingErrors expected = model.expected(sample.features);
  return static_cast<std::size_t>(std::ranges::min_element(expected) - expected.begin());
}

/// What the choice costs against the best setting in hindsight.
void report_cost(const std::vector<SettingSample>& samples, const SettingModel& model) {
  constexpr double kDear = 0.2;
  const auto count = static_cast<double>(samples.size());
  double in_sample = 0, left_out = 0;
  for (const SettingSample& sample : samples) in_sample += loss(sample, pick(sample, model)) / count;
  std::map<std::string, std::vector<double>> losses_left_out;
  visit_left_out(
      samples, [](const auto& some) { return fitted<SettingModel>(some); },
      [&](const SettingSample& sample, const SettingModel& without) {
        losses_left_out[sample.family].push_back(loss(sample, pick(sample, without)));
      });
  for (const auto& [family, losses] : losses_left_out) {
    const double sum = std::accumulate(losses.begin(), losses.end(), 0.0);
    left_out += sum / count;
    const double mean = sum / static_cast<double>(losses.size());
    if (mean > kDear) fmt::print(stderr, "  family {}: {:.3f}\n", family, std::exp(mean));
  }
  fmt::print(stderr, "{} pairs. Over the best setting in hindsight: {:.3f}, families left out {:.3f}\n", samples.size(),
             std::exp(in_sample), std::exp(left_out));
  for (std::size_t i = 0; i < kSettings.size(); ++i) {
    double always = 0;
    for (const SettingSample& sample : samples) always += loss(sample, i) / count;
    const auto best = std::ranges::count_if(samples, [&](const SettingSample& sample) { return loss(sample, i) == 0; });
    fmt::print(stderr, "  always {} {}: {:.3f}; best for {}\n", kSettings[i].family.name, kSettings[i].weight,
               std::exp(always), best);
  }
}

void write_table(const std::vector<std::string>& files) {
  const auto samples = read_samples<SettingSample>(files);
  const Fit<SettingModel> fit = fitted<SettingModel>(pointers_to(samples));
  report_cost(samples, fit.model);
  print_table_head("core/choice/expected_error.h");
  print_table(fit, "SettingModel", "");
}

}  // namespace
}  // namespace crease::quality

int main(int count, char** arguments) try {
  using namespace crease::quality;
  CLI::App app{
      "Fits the automatic choice: solves every setting, or every weight for scans, on the training pairs, and "
      "regresses their errors"};
  app.require_subcommand(1);
  Part of;
  std::vector<std::string> files;
  const auto add_measure = [&](const char* name, const char* what) {
    CLI::App* measure = app.add_subcommand(name, what);
    measure->add_option("--part", of.part, "Number of the part, from 0");
    measure->add_option("--parts", of.parts, "Take every so manieth pair or model")->check(CLI::PositiveNumber);
    return measure;
  };
  const auto add_measure_of_models = [&](const char* name, const char* what) {
    CLI::App* measure = add_measure(name, what);
    measure->add_option("--models", of.models, "Measure the models of these folders, too")
        ->check(CLI::ExistingDirectory);
    return measure;
  };
  const auto add_table = [&](const char* name, const char* what) {
    CLI::App* table = app.add_subcommand(name, what);
    table->add_option("files", files, "What was measured")->required()->check(CLI::ExistingFile);
    return table;
  };
  CLI::App* measure = add_measure("measure", "Prints features and errors of settings, a pair per line");
  measure->add_option("--meshes", of.meshes, "Folder of pairs with measured noise");
  measure->add_option("--models", of.models, "Measure the models of these folders in place of the training pairs")
      ->check(CLI::ExistingDirectory);
  CLI::App* table =
      add_table("table", "Prints core/choice/expected_error_table.h, and the cost of the choice to stderr");
  CLI::App* second_table =
      add_table("second-table", "Prints core/choice/second_look_table.h, and the cost of the choice to stderr");
  CLI::App* clean =
      add_measure_of_models("measure-clean", "Prints features of meshes without noise and with little, a line each");
  CLI::App* clean_table =
      add_table("clean-table", "Prints core/choice/clean_table.h, and what is taken for clean to stderr");
  CLI::App* directions =
      add_measure_of_models("measure-directions", "Prints what tells the direction of noise, a mesh per line");
  CLI::App* direction_table =
      add_table("direction-table", "Prints core/choice/noise_direction_table.h, and how often it is right to stderr");
  CLI::App* scans =
      add_measure_of_models("measure-scans", "Prints features and errors of weights for scans, a pair per line");
  scans->add_option("--kind", of.kind, "Measure scans of this kind only")
      ->check(CLI::IsMember({"views", "fused", "whole"}));
  CLI::App* scan_table =
      add_table("scan-table", "Prints core/choice/scan_error_table.h, and the cost of the choice to stderr");
  bool keeps = false;
  scan_table->add_flag("--keep", keeps, "Fit to the pairs of the present table, too");
  CLI::App* weights =
      add_measure_of_models("measure-weights", "Prints features and errors of weights of the chosen setting");
  CLI::App* weight_table = add_table("weight-table", "Prints core/choice/weight_table.h, and its gain to stderr");
  std::string file;
  CLI::App* normals = add_measure_of_models("measure-normals",
                                            "Writes what the regression of normals sees of faces, for fit_normals.py");
  std::size_t pass = 0;
  normals->add_option("--pass", pass, "The pass that finds them so")
      ->transform(CLI::CheckedTransformer(std::map<std::string, std::size_t>{{"first", 0}, {"second", 1}}));
  normals->add_option("--out", file, "File to write")->required();
  CLI::App* labels =
      add_measure_of_models("measure-labels", "Writes what the regression of labels sees of edges, for fit_labels.py");
  labels->add_option("--out", file, "File to write")->required();
  CLI11_PARSE(app, count, arguments);
  if (measure->parsed()) {
    if (of.models.empty()) measure_pairs(of);
    for (const std::string& folder : of.models) measure_models(folder, of);
  }
  if (table->parsed()) write_table(files);
  if (second_table->parsed()) write_second_table(files);
  if (clean->parsed()) measure_clean(of);
  if (clean_table->parsed()) write_clean_table(files);
  if (directions->parsed()) measure_directions(of);
  if (direction_table->parsed()) write_direction_table(files);
  if (scans->parsed()) measure_scans(of);
  if (weights->parsed()) measure_weights(of);
  if (weight_table->parsed()) write_weight_table(files);
  if (normals->parsed()) measure_normals(of, pass, file);
  if (labels->parsed()) measure_labels(of, file);
  if (scan_table->parsed()) write_scan_table(files, keeps);
} catch (const std::exception& error) {
  std::fputs((std::string(error.what()) + "\n").c_str(), stderr);
  return 1;
}
