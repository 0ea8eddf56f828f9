#include "tests/quality/fit_weights.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <random>

#include "core/choice/choice.h"
#include "core/choice/error_model.h"
#include "core/choice/weight.h"
#include "core/regression/passes.h"
#include "tests/quality/error_fit.h"
#include "tests/quality/known_upload.h"
#include "tests/quality/pairs.h"

namespace crease::quality {
namespace {

using WeightSample = Sample<WeightModel>;

struct WeightFit {
  WeightModel model;
};

void print_measured(const Mesh& original, const Mesh& noisy, const std::string& name, const std::string& family) {
  const Topology topology = build_topology(noisy);
  const Surface surface(noisy, topology);
  const FlatMesh mesh(surface);
  ThreadTeam team(1);
  const Solve solve = solve_with(team);
  GraduatedOptions last;
  std::vector<float> precisions;
  const Solve remembering = [&](const SolveRequest& request) {
    if (request.final) {
      last = request.options;
      precisions.assign(request.precisions.begin(), request.precisions.end());
    }
    return solve(request);
  };
  ChoiceReport report;
  const ChoiceResult chosen = choose_and_solve(surface, mesh, {}, {}, remembering, report, team);
  if (!(report.noise_sigma > 0)) return;
  const KnownUpload known(surface, look_at(surface, std::nullopt, std::nullopt, team), solve);
  std::vector<double> errors;
  for (const double factor : kWeightFactors) {
    GraduatedOptions options = last;
    options.weight = static_cast<float>(chosen.setting.weight * factor);
    const GraduatedResult result = solve({mesh, mesh.measured, options, precisions, {}, true});
    const Turned turned = turned_in_passes(mesh, result.positions, chosen.reference_positions,
                                           sight_of(chosen.setting, report), 1, {}, kPasses, team);
    errors.push_back(normal_error_deg(original, turned.positions));
  }
  fmt::print("{} {} {:.6g} {:.5g}\n", name, family, fmt::join(known.features, " "), fmt::join(errors, " "));
  std::fflush(stdout);
}

/// The logarithm of an error over that with the setting's own weight.
double error_over_own(const WeightSample& sample, std::size_t factor) {
  return log_error(sample.errors[factor]) - log_error(sample.errors[kOwnWeight]);
}

WeightFit fitted_lines(const std::vector<const WeightSample*>& samples) {
  constexpr double kFarthestError = 0.4;
  constexpr auto kInputs = static_cast<Eigen::Index>(kFeatures);
  constexpr auto kOutputs = static_cast<Eigen::Index>(kWeightFactors.size());
  WeightFit fit;
  standardise(samples, &WeightSample::features, fit.model);
  const auto count = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd inputs(count, kInputs), outputs(count, kOutputs);
  for (Eigen::Index s = 0; s < count; ++s) {
    const WeightSample& sample = *samples[static_cast<std::size_t>(s)];
    for (Eigen::Index k = 0; k < kInputs; ++k) {
      const auto place = static_cast<std::size_t>(k);
      inputs(s, k) = standardised(sample.features.at(place), fit.model.means.at(place), fit.model.deviations.at(place));
    }
    for (Eigen::Index i = 0; i < kOutputs; ++i) {
      outputs(s, i) = std::clamp(error_over_own(sample, static_cast<std::size_t>(i)), -kFarthestError, kFarthestError);
    }
  }
  const Eigen::RowVectorXd means = outputs.colwise().mean();
  outputs.rowwise() -= means;
  const Eigen::MatrixXd slopes = ridge_slopes(inputs, outputs);
  for (Eigen::Index i = 0; i < kOutputs; ++i) {
    fit.model.mean_errors.at(static_cast<std::size_t>(i)) = means(i);
    for (Eigen::Index k = 0; k < kInputs; ++k) {
      fit.model.slopes.at(static_cast<std::size_t>(k)).at(static_cast<std::size_t>(i)) = slopes(k, i);
    }
  }
  return fit;
}

void report_gain(const std::vector<WeightSample>& samples) {
  const auto count = static_cast<double>(samples.size());
  double left_out = 0, hindsight = 0;
  visit_left_out(samples, fitted_lines, [&](const WeightSample& sample, const WeightModel& without) {
    left_out += error_over_own(sample, best_factor(without.expected(sample.features))) / count;
    hindsight -= loss(sample, kOwnWeight) / count;
  });
  fmt::print(stderr, "{} pairs. Over the settings' own weights: {:.4f} with families left out, {:.4f} in hindsight\n",
             samples.size(), std::exp(left_out), std::exp(hindsight));
}

}  // namespace

void measure_weights(const Part& of) {
  constexpr std::size_t kPairsOfModel = 3, kFewestVertices = 100, kMostFaces = 60'000;
  const std::vector<TrainingModel> models = training_models({PairSet::kTraining}, of.models);
  for (std::size_t m = of.part; m < models.size(); m += of.parts) {
    const std::optional<Mesh> original = models[m].load();
    if (!original || original->positions.size() < kFewestVertices || original->triangles.size() > kMostFaces) continue;
    std::mt19937_64 random(m + 1);
    for (std::size_t k = 0; k < kPairsOfModel; ++k) {
      const auto& [noise, level] = training_noises()[random() % training_noises().size()];
      print_measured(*original, add_noise_of_kind(*original, noise, level, random()),
                     fmt::format("{}-{}-{}", models[m].name, word_of(noise), level), models[m].family);
    }
  }
}

void write_weight_table(const std::vector<std::string>& files) {
  const auto samples = read_samples<WeightSample>(files);
  report_gain(samples);
  const WeightModel model = fitted_lines(pointers_to(samples)).model;
  print_table_head("core/choice/weight.h");
  fmt::print(
      "inline constexpr Features kWeightFeatureMeans{{{}}};\n"
      "inline constexpr Features kWeightFeatureDeviations{{{}}};\n"
      "inline constexpr WeightModel::Errors kWeightMeanErrors{{{}}};\n"
      "inline constexpr std::array<WeightModel::Errors, kFeatures> kWeightSlopes{{{{\n",
      row_of(model.means), row_of(model.deviations), row_of(model.mean_errors));
  for (const WeightModel::Errors& slopes : model.slopes) fmt::print("{},\n", row_of(slopes));
  fmt::print("}}}};\n");
  print_table_end();
}

}  // namespace crease::quality
