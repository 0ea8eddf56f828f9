#pragma once

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "core/choice/choice.h"
#include "core/graduated/flat_mesh.h"
#include "core/measure/measure.h"

namespace crease::quality {

/// A training pair: what an ErrorModel sees of it, and the errors it is to expect, mean angles between normals in
/// degrees.
template <typename Model>
struct Sample {
  std::string pair, family;
  typename Model::Features features{};
  typename Model::Errors errors{};

  void read(std::istream& words) {
    words >> pair >> family;
    for (double& feature : features) words >> feature;
    for (double& error : errors) words >> error;
  }
};

/// A sample per line. Throws std::runtime_error for other lines.
template <typename AnySample>
std::vector<AnySample> read_samples(const std::vector<std::string>& files) {
  std::vector<AnySample> samples;
  for (const std::string& name : files) {
    std::ifstream file(name);
    for (std::string line; std::getline(file, line);) {
      std::istringstream words(line);
      samples.emplace_back().read(words);
      if (!words)
        throw std::runtime_error(fmt::format("{}: a row is not of these features and errors: {}", name, line));
    }
  }
  return samples;
}

/// Solves on the threads of `team`, and remembers nothing.
inline Solve solve_with(ThreadTeam& team) {
  return [&team](const SolveRequest& request) {
    return GraduatedDescent(request.mesh, request.measured, request.options, request.precisions, request.latent, team)
        .run();
  };
}

inline double normal_error_deg(const Mesh& original, const FlatVectors& positions) {
  Mesh moved = original;
  for (std::size_t v = 0; v < moved.positions.size(); ++v) {
    const auto p = vector_at(positions, v);
    moved.positions[v] = Vec3(p[0], p[1], p[2]);
  }
  return measure(original, moved).mean_normal_error_deg;
}

/// Errors below 0.1 degrees count as this.
inline double log_error(double error) {
  constexpr double kLeastErrorDeg = 0.1;
  return std::log(std::max(kLeastErrorDeg, error));
}

/// Logarithm of the error of a method over that of the best one.
template <typename AnySample>
double loss(const AnySample& sample, std::size_t method) {
  return log_error(sample.errors[method]) - log_error(*std::ranges::min_element(sample.errors));
}

/// A model whose landmarks it owns.
template <typename Model>
struct Fit {
  Model model;
  std::vector<typename Model::Landmark> landmarks;
};

/// Sets the means and deviations of a model to those of some numbers of the samples.
template <typename Model, typename AnySample, typename Owner, typename Numbers>
void standardise(const std::vector<const AnySample*>& samples, Numbers Owner::*numbers, Model& model) {
  const auto count = static_cast<double>(samples.size());
  for (std::size_t k = 0; k < model.means.size(); ++k) {
    const auto value = [&](const AnySample* sample) { return (sample->*numbers)[k]; };
    double squares = 0;
    for (const AnySample* sample : samples) model.means[k] += value(sample) / count;
    for (const AnySample* sample : samples) squares += std::pow(value(sample) - model.means[k], 2) / count;
    model.deviations[k] = std::sqrt(squares) + 1e-6;
  }
}

template <typename AnySample>
std::vector<const AnySample*> pointers_to(const std::vector<AnySample>& samples) {
  std::vector<const AnySample*> pointers;
  for (const AnySample& sample : samples) pointers.push_back(&sample);
  return pointers;
}

/// Kernel ridge regression: sets the landmarks of a model that is standardised, so that it expects `errors`, a row per
/// sample, beyond what it has without them.
template <typename Model, typename AnySample>
void set_landmarks(Fit<Model>& fit, const std::vector<const AnySample*>& samples, const Eigen::MatrixXd& errors,
                   double penalty) {
  const auto count = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd alike(count, count);
  for (Eigen::Index s = 0; s < count; ++s) {
    fit.landmarks.push_back({fit.model.described(samples[static_cast<std::size_t>(s)]->features), {}});
    for (Eigen::Index other = 0; other <= s; ++other) {
      alike(s, other) =
          Model::likeness(fit.landmarks.back().features, fit.landmarks[static_cast<std::size_t>(other)].features);
    }
  }
  alike.diagonal().array() += penalty;
  const Eigen::MatrixXd influence = alike.template selfadjointView<Eigen::Lower>().llt().solve(errors);
  for (Eigen::Index s = 0; s < count; ++s) {
    auto& row = fit.landmarks[static_cast<std::size_t>(s)].influence;
    for (std::size_t i = 0; i < row.size(); ++i) row[i] = influence(s, static_cast<Eigen::Index>(i));
  }
  fit.model.landmarks = fit.landmarks;
}

/// Slopes of a ridge regression, a column for each of the errors. `inputs` and `errors` have a row per sample.
inline Eigen::MatrixXd ridge_slopes(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& errors) {
  constexpr double kPenalty = 100;
  const Eigen::MatrixXd penalty = kPenalty * Eigen::MatrixXd::Identity(inputs.cols(), inputs.cols());
  return (inputs.transpose() * inputs + penalty).llt().solve(inputs.transpose() * errors);
}

/// What a logistic regression is to say of a sample, and how much that counts.
struct Verdict {
  bool is_so = false;
  double weight = 1;
};

/// Logistic regression by Newton's method, of a model that is standardised.
template <typename Model, typename AnySample, typename Numbers, typename VerdictOn>
void fit_odds(Model& model, const std::vector<const AnySample*>& samples, Numbers AnySample::*numbers,
              VerdictOn verdict_on) {
  constexpr double kPenalty = 1;
  constexpr int kSteps = 30;
  constexpr auto kTerms = static_cast<Eigen::Index>(std::tuple_size_v<typename Model::Terms>);
  using Terms = Eigen::Matrix<double, kTerms, 1>;
  using Square = Eigen::Matrix<double, kTerms, kTerms>;
  Terms factors = Terms::Zero();
  for (int step = 0; step < kSteps; ++step) {
    Terms slope = -kPenalty * factors;
    Square curvature = Square::Identity() * kPenalty;
    for (const AnySample* sample : samples) {
      const auto row = model.terms_of(sample->*numbers);
      const Terms terms = Eigen::Map<const Terms>(row.data());
      const auto [is_so, weight] = verdict_on(*sample);
      const double share = 1 / (1 + std::exp(-factors.dot(terms)));
      slope += weight * ((is_so ? 1 : 0) - share) * terms;
      curvature += weight * share * (1 - share) * terms * terms.transpose();
    }
    factors += curvature.ldlt().solve(slope);
  }
  Eigen::Map<Terms>(model.factors.data()) = factors;
}

/// What large influences cost.
inline constexpr double kPenaltyOfInfluences = 0.1;

/// The pairs that a model was fitted to, each of a family of its own, since their names are not in its table. The loss
/// of each is what the model expects of it, plus the penalty times its influence.
template <typename AnySample, typename Model>
std::vector<AnySample> samples_known_to(const Model& model) {
  std::vector<AnySample> samples;
  for (const typename Model::Landmark& landmark : model.landmarks) {
    AnySample& sample = samples.emplace_back();
    sample.family = fmt::format("known{}", samples.size());
    for (std::size_t k = 0; k < sample.features.size(); ++k) {
      sample.features[k] = model.means[k] + model.deviations[k] * landmark.features[k] / Model::kStepsPerDeviation;
    }
    sample.errors = model.expected(sample.features);
    for (std::size_t i = 0; i < sample.errors.size(); ++i) {
      sample.errors[i] = std::exp(sample.errors[i] + kPenaltyOfInfluences * landmark.influence[i]);
    }
  }
  return samples;
}

/// A model that expects `error_of(sample, method)`. It takes the means and deviations of its features from
/// `standards`, if given.
template <typename Model, typename AnySample, typename ErrorOf>
Fit<Model> fitted_to(const std::vector<const AnySample*>& samples, ErrorOf error_of, const Model* standards = nullptr) {
  const auto count = static_cast<Eigen::Index>(samples.size());
  Fit<Model> fit;
  if (standards != nullptr) {
    fit.model.means = standards->means;
    fit.model.deviations = standards->deviations;
  } else {
    standardise(samples, &AnySample::features, fit.model);
  }
  const std::size_t methods = fit.model.mean_errors.size();
  Eigen::MatrixXd errors(count, static_cast<Eigen::Index>(methods));
  for (std::size_t i = 0; i < methods; ++i) {
    auto column = errors.col(static_cast<Eigen::Index>(i));
    for (Eigen::Index s = 0; s < count; ++s) column(s) = error_of(*samples[static_cast<std::size_t>(s)], i);
    fit.model.mean_errors[i] = column.mean();
    column.array() -= fit.model.mean_errors[i];
  }
  set_landmarks(fit, samples, errors, kPenaltyOfInfluences);
  return fit;
}

/// Regression of the logarithms of the errors over the smallest of their pair.
template <typename Model, typename AnySample>
Fit<Model> fitted(const std::vector<const AnySample*>& samples, const Model* standards = nullptr) {
  const auto error_of = [](const AnySample& sample, std::size_t method) {
    return std::min(Model::kWorst, loss(sample, method));
  };
  return fitted_to<Model>(samples, error_of, standards);
}

/// Calls `use` with each sample and a model that `fit_to` has fitted without the sample's family: a tenth of the
/// families is left out at a time.
template <typename AnySample, typename FitTo, typename Use>
void visit_left_out(const std::vector<AnySample>& samples, FitTo fit_to, Use use) {
  constexpr std::size_t kFolds = 10;
  std::map<std::string, std::size_t> folds;
  for (const AnySample& sample : samples) folds.emplace(sample.family, folds.size() % kFolds);
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    std::vector<const AnySample*> others;
    for (const AnySample& sample : samples) {
      if (folds.at(sample.family) != fold) others.push_back(&sample);
    }
    const auto fit = fit_to(others);
    for (const AnySample& sample : samples) {
      if (folds.at(sample.family) == fold) use(sample, fit.model);
    }
  }
}

template <typename Numbers>
std::string row_of(const Numbers& numbers) {
  return fmt::format("{{{:.5g}}}", fmt::join(numbers, ", "));
}

/// The head of a table that a program writes and nobody reads.
inline void print_table_head(std::string_view include) {
  fmt::print(
      "#pragma once\n\n#include \"{}\"\n\nnamespace crease {{\n\n"
      "// Written by fit_choice in tests/quality.\n// clang-format off\n\n",
      include);
}

/// A constant for an OddsModel.
template <typename Model>
void print_odds(const Model& model, std::string_view type, std::string_view name) {
  fmt::print("inline constexpr {} {}{{{{{}}}, {{{}}}, {{{}}}}};\n", type, name, row_of(model.means),
             row_of(model.deviations), row_of(model.factors));
}

inline void print_table_end() { fmt::print("\n// clang-format on\n\n}}  // namespace crease\n"); }

/// Constants named kPREFIXFeatureMeans and so on, and the end of the file.
template <typename Model>
void print_table(const Fit<Model>& fit, std::string_view type, std::string_view prefix) {
  fmt::print(
      "inline constexpr {0}::Features k{1}FeatureMeans{{{2}}};\n"
      "inline constexpr {0}::Features k{1}FeatureDeviations{{{3}}};\n"
      "inline constexpr {0}::Errors k{1}MeanErrors{{{4}}};\n"
      "inline constexpr std::array<{0}::Landmark, {5}> k{1}Landmarks{{{{\n",
      type, prefix, row_of(fit.model.means), row_of(fit.model.deviations), row_of(fit.model.mean_errors),
      fit.landmarks.size());
  for (const auto& landmark : fit.landmarks) {
    fmt::print("{{{{{{{}}}}},{{{{{:.6g}}}}}}},\n", fmt::join(landmark.features, ","),
               fmt::join(landmark.influence, ","));
  }
  fmt::print("}}}};\n");
  print_table_end();
}

}  // namespace crease::quality
