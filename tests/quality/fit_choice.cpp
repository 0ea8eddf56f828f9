// Fits core/choice/expected_error_table.h: fit_choice --help

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <map>
#include <sstream>

#include "core/choice/evidence.h"
#include "core/choice/expected_error.h"
#include "core/choice/features.h"
#include "core/measure/measure.h"
#include "tests/quality/pairs.h"

namespace crease::quality {
namespace {

constexpr std::size_t kSettingCount = kSettings.size(), kMostFaces = 40'000, kFewestVertices = 100;
constexpr double kLeastErrorDeg = 0.1;  ///< errors below it count as this

/// What is learnt from: a pair whose noise is not correlated.
struct Sample {
  std::string pair, family;
  Features features{};
  std::array<double, kSettingCount> errors{};  ///< mean angle between normals in degrees
};

double normal_error_deg(const Mesh& original, const FlatVectors& positions) {
  Mesh moved = original;
  for (std::size_t v = 0; v < moved.positions.size(); ++v) {
    const auto p = vector_at(positions, v);
    moved.positions[v] = Vec3(p[0], p[1], p[2]);
  }
  return measure(original, moved).mean_normal_error_deg;
}

Sample measured(const PairRecipe& recipe, const Pair& pair) {
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
  Sample sample{pair.name, recipe.family, features_of(mesh, evidence), {}};
  for (std::size_t i = 0; i < kSettingCount; ++i) {
    const GraduatedOptions options = evidence.sight.options(kSettings[i], evidence.variance, false);
    const GraduatedResult result = solve({mesh, mesh.measured, options, evidence.precisions, {}});
    sample.errors[i] = normal_error_deg(pair.original, result.positions);
  }
  return sample;
}

void measure_pairs(std::size_t part, std::size_t parts, const std::string& folder) {
  std::vector<PairRecipe> recipes = recipes_of(PairSet::kTraining);
  for (const PairRecipe& recipe : recipes_of(PairSet::kDevelopment)) {
    if (recipe.noise != Noise::kCorrelated && recipe.level > 0) recipes.push_back(recipe);
  }
  for (std::size_t i = part; i < recipes.size(); i += parts) {
    const std::optional<Pair> pair = build_pair(recipes[i], folder);
    if (!pair || pair->original.triangles.size() > kMostFaces || pair->original.positions.size() < kFewestVertices) {
      continue;
    }
    const Sample sample = measured(recipes[i], *pair);
    fmt::print("{} {} {} {}\n", sample.pair, sample.family, fmt::join(sample.features, " "),
               fmt::join(sample.errors, " "));
    std::fflush(stdout);
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

/// Ridge regression of the logarithms of the errors over the smallest of their pair.
class Regression {
 public:
  explicit Regression(const std::vector<Sample>& samples) {
    const auto count = static_cast<double>(samples.size());
    for (std::size_t k = 0; k < kFeatures; ++k) {
      double squares = 0;
      for (const Sample& sample : samples) model_.means[k] += sample.features[k] / count;
      for (const Sample& sample : samples) squares += std::pow(sample.features[k] - model_.means[k], 2) / count;
      model_.deviations[k] = std::sqrt(squares) + 1e-6;
    }
    for (const Sample& sample : samples) add(sample, 1);
  }

  void add(const Sample& sample, double times) {
    Row x = Row::Ones(kFeatures + 1);
    for (std::size_t k = 0; k < kFeatures; ++k) {
      x(static_cast<Eigen::Index>(k)) = std::clamp((sample.features[k] - model_.means[k]) / model_.deviations[k],
                                                   -ErrorModel::kFarthest, ErrorModel::kFarthest);
    }
    Row y(kSettingCount);
    const double least = std::log(std::max(kLeastErrorDeg, *std::ranges::min_element(sample.errors)));
    for (std::size_t i = 0; i < kSettingCount; ++i) {
      const double error = std::log(std::max(kLeastErrorDeg, sample.errors[i])) - least;
      y(static_cast<Eigen::Index>(i)) = std::min(ErrorModel::kWorst, error);
    }
    normal_ += times * x.transpose() * x;
    right_ += times * x.transpose() * y;
  }

  ErrorModel solved() const {
    constexpr double kPenalty = 5;
    Matrix normal = normal_;
    for (Eigen::Index k = 0; k < static_cast<Eigen::Index>(kFeatures); ++k) normal(k, k) += kPenalty;
    const Matrix solution = normal.ldlt().solve(right_);
    ErrorModel model = model_;
    for (std::size_t i = 0; i < kSettingCount; ++i) {
      const auto column = static_cast<Eigen::Index>(i);
      for (std::size_t k = 0; k < kFeatures; ++k) model.weights[i][k] = solution(static_cast<Eigen::Index>(k), column);
      model.constants[i] = solution(kFeatures, column);
    }
    return model;
  }

 private:
  using Matrix = Eigen::MatrixXd;
  using Row = Eigen::RowVectorXd;

  ErrorModel model_;
  Matrix normal_ = Matrix::Zero(kFeatures + 1, kFeatures + 1), right_ = Matrix::Zero(kFeatures + 1, kSettingCount);
};

/// Logarithm of the error of the setting that `model` picks over that of the best one.
double loss(const Sample& sample, const ErrorModel& model) {
  const auto expected = expected_log_errors(sample.features, model);
  const auto picked = static_cast<std::size_t>(std::ranges::min_element(expected) - expected.begin());
  const auto log_error = [](double error) { return std::log(std::max(kLeastErrorDeg, error)); };
  return log_error(sample.errors[picked]) - log_error(*std::ranges::min_element(sample.errors));
}

/// What the choice costs against the best setting in hindsight, each family of models left out of the fit in its turn.
void report_cost(const std::vector<Sample>& samples, const Regression& whole) {
  std::map<std::string, std::vector<const Sample*>> families;
  for (const Sample& sample : samples) families[sample.family].push_back(&sample);
  double left_out = 0, fitted = 0;
  const ErrorModel all = whole.solved();
  std::vector<std::pair<double, std::string>> costs;
  for (const auto& [family, members] : families) {
    Regression others = whole;
    for (const Sample* sample : members) others.add(*sample, -1);
    const ErrorModel model = others.solved();
    double sum = 0;
    for (const Sample* sample : members) {
      sum += loss(*sample, model);
      fitted += loss(*sample, all);
    }
    left_out += sum;
    costs.emplace_back(sum / static_cast<double>(members.size()), family);
  }
  const auto count = static_cast<double>(samples.size());
  fmt::print(stderr, "{} pairs of {} families. Over the best setting in hindsight: {:.3f}, families left out {:.3f}\n",
             samples.size(), families.size(), std::exp(fitted / count), std::exp(left_out / count));
  for (std::size_t i = 0; i < kSettingCount; ++i) {
    double fixed = 0, best = 0;
    for (const Sample& sample : samples) {
      ErrorModel only{};
      only.deviations.fill(1);
      only.constants.fill(1);
      only.constants[i] = 0;
      fixed += loss(sample, only);
      best += *std::ranges::min_element(sample.errors) == sample.errors[i] ? 1 : 0;
    }
    fmt::print(stderr, "  always {} {}: {:.3f}; best for {}\n", kSettings[i].family.name, kSettings[i].weight,
               std::exp(fixed / count), best);
  }
  std::ranges::sort(costs, std::greater());
  for (const auto& [cost, family] : costs) {
    if (cost > 0.2) fmt::print(stderr, "  family {}: {:.3f}\n", family, std::exp(cost));
  }
}

template <typename Numbers>
std::string row_of(const Numbers& numbers) {
  return fmt::format("{{{:.5g}}}", fmt::join(numbers, ", "));
}

void write_table(const std::vector<Sample>& samples) {
  const Regression regression(samples);
  report_cost(samples, regression);
  const ErrorModel model = regression.solved();
  fmt::print(
      "#pragma once\n\n#include \"core/choice/expected_error.h\"\n\nnamespace crease {{\n\n"
      "// Written by fit_choice in tests/quality.\n// clang-format off\n\n"
      "inline constexpr ErrorModel kErrorModel{{\n    .means = {{{}}},\n    .deviations = {{{}}},\n"
      "    .constants = {{{}}},\n    .weights = {{{{\n",
      row_of(model.means), row_of(model.deviations), row_of(model.constants));
  for (const Features& weights : model.weights) fmt::print("        {{{}}},\n", row_of(weights));
  fmt::print("    }}}}}};\n\n// clang-format on\n\n}}  // namespace crease\n");
}

}  // namespace
}  // namespace crease::quality

int main(int count, char** arguments) try {
  CLI::App app{"Fits the automatic choice: solves every setting on the training pairs, and regresses their errors"};
  app.require_subcommand(1);
  std::size_t part = 0, parts = 1;
  std::string folder;
  CLI::App* measure = app.add_subcommand("measure", "Prints features and errors, a pair per line");
  measure->add_option("--part", part, "Number of the part, from 0");
  measure->add_option("--parts", parts, "Take every so manieth pair")->check(CLI::PositiveNumber);
  measure->add_option("--meshes", folder, "Folder of pairs with measured noise");
  std::vector<std::string> files;
  CLI::App* table =
      app.add_subcommand("table", "Prints core/choice/expected_error_table.h, and the cost of the choice to stderr");
  table->add_option("files", files, "What measure printed")->required()->check(CLI::ExistingFile);
  CLI11_PARSE(app, count, arguments);
  if (measure->parsed()) crease::quality::measure_pairs(part, parts, folder);
  if (table->parsed()) crease::quality::write_table(crease::quality::read(files));
} catch (const std::exception& error) {
  std::fputs((std::string(error.what()) + "\n").c_str(), stderr);
  return 1;
}
