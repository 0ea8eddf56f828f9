#include "tests/quality/fit_second_look.h"

#include <cstdio>
#include <utility>

namespace crease::quality {
namespace {

/// A setting that is tried on a pair.
struct Row {
  SecondLookModel::Features features{};
  double error = 0;  ///< logarithm, over the mean of those tried
  std::size_t setting = 0;
};

/// A pair with the settings that the first model takes for likely without knowing the family.
struct SecondSample {
  std::string family;
  std::vector<Row> rows;  ///< the likeliest first
  SettingModel::Errors errors{};
};

std::vector<TriedSetting> tried(const SettingSample& sample, const SettingErrors& expected) {
  std::vector<TriedSetting> all;
  const std::vector<std::size_t> likely = likely_settings(expected);
  for (const std::size_t i : likely) {
    TriedSetting& setting = all.emplace_back(TriedSetting{i, expected[i], sample.looks[i], sample.angle_deg(0, i + 1)});
    for (const std::size_t j : likely) {
      setting.from_others += sample.angle_deg(i + 1, j + 1) / static_cast<double>(likely.size());
    }
  }
  return all;
}

SecondSample second_sample(const SettingSample& sample, const SettingModel& without_family) {
  constexpr double kFarthest = 0.5;
  const auto settings = tried(sample, without_family.expected(sample.features));
  const auto features = second_features(sample.features, settings);
  double mean = 0;
  for (const TriedSetting& setting : settings) {
    mean += log_error(sample.errors[setting.setting]) / static_cast<double>(settings.size());
  }
  SecondSample second{sample.family, {}, sample.errors};
  for (std::size_t k = 0; k < settings.size(); ++k) {
    const std::size_t i = settings[k].setting;
    second.rows.push_back({features[k], std::clamp(log_error(sample.errors[i]) - mean, -kFarthest, kFarthest), i});
  }
  return second;
}

void fit_slopes(const std::vector<const Row*>& rows, SecondLookModel& model) {
  const auto count = static_cast<Eigen::Index>(rows.size()), features = static_cast<Eigen::Index>(model.slopes.size());
  Eigen::MatrixXd inputs(count, features), errors(count, 1);
  for (Eigen::Index r = 0; r < count; ++r) {
    const Row& row = *rows[static_cast<std::size_t>(r)];
    const auto description = model.described(row.features);
    for (Eigen::Index k = 0; k < features; ++k) {
      inputs(r, k) = description[static_cast<std::size_t>(k)] / SecondLookModel::kStepsPerDeviation;
    }
    errors(r, 0) = row.error;
  }
  const Eigen::VectorXd slopes = ridge_slopes(inputs, errors);
  for (Eigen::Index k = 0; k < features; ++k) model.slopes[static_cast<std::size_t>(k)] = slopes(k);
}

/// Lines for all rows, and a kernel for what every so manieth of them is off the lines.
Fit<SecondLookModel> fit_second(const std::vector<const SecondSample*>& samples) {
  constexpr std::size_t kMostLandmarks = 2400;
  constexpr double kPenalty = 0.3;
  std::vector<const Row*> rows, some;
  for (const SecondSample* sample : samples) {
    if (sample->rows.size() < 2) continue;
    for (const Row& row : sample->rows) rows.push_back(&row);
  }
  Fit<SecondLookModel> fit;
  standardise(rows, &Row::features, fit.model);
  fit_slopes(rows, fit.model);
  const std::size_t kept = std::min(rows.size(), kMostLandmarks);
  for (std::size_t k = 0; k < kept; ++k) some.push_back(rows[k * rows.size() / kept]);
  Eigen::MatrixXd errors(static_cast<Eigen::Index>(kept), 1);
  for (std::size_t k = 0; k < kept; ++k) {
    errors(static_cast<Eigen::Index>(k), 0) =
        some[k]->error - fit.model.along_slopes(fit.model.described(some[k]->features));
  }
  set_landmarks(fit, some, errors, kPenalty);
  return fit;
}

std::size_t pick(const SecondSample& sample, const SecondLookModel& model) {
  const auto best =
      std::ranges::min_element(sample.rows, {}, [&](const Row& row) { return model.expected_error(row.features); });
  return sample.rows.size() < 2 ? sample.rows.front().setting : best->setting;
}

void report_cost(const std::vector<SecondSample>& samples, const SecondLookModel& model) {
  const auto count = static_cast<double>(samples.size());
  double before = 0, fitted_cost = 0, left_out = 0, solves = 0;
  for (const SecondSample& sample : samples) {
    before += loss(sample, sample.rows.front().setting) / count;
    fitted_cost += loss(sample, pick(sample, model)) / count;
    solves += static_cast<double>(sample.rows.size() > 1 ? sample.rows.size() : 0) / count;
  }
  visit_left_out(samples, fit_second, [&](const SecondSample& sample, const SecondLookModel& without) {
    left_out += loss(sample, pick(sample, without)) / count;
  });
  fmt::print(
      stderr,
      "{} pairs, {:.2f} settings tried. Over the best setting in hindsight, families left out: likeliest {:.3f}, "
      "best looking {:.3f}; fitted {:.3f}\n",
      samples.size(), solves, std::exp(before), std::exp(left_out), std::exp(fitted_cost));
}

}  // namespace

void SettingSample::read(std::istream& words) {
  Sample<SettingModel>::read(words);
  for (Look& look : looks) {
    for (double& feature : look) words >> feature;
  }
  for (double& angle : angles) words >> angle;
}

double SettingSample::angle_deg(std::size_t result, std::size_t other) const {
  if (result == other) return 0;
  if (result > other) std::swap(result, other);
  constexpr std::size_t kResults = kSettings.size() + 1;
  return angles.at(result * (2 * kResults - result - 1) / 2 + other - result - 1);
}

void write_second_table(const std::vector<std::string>& files) {
  const auto samples = read_samples<SettingSample>(files);
  std::vector<SecondSample> seconds;
  visit_left_out(
      samples, [](const auto& some) { return fitted<SettingModel>(some); },
      [&](const SettingSample& sample, const SettingModel& without) {
        seconds.push_back(second_sample(sample, without));
      });
  const Fit<SecondLookModel> fit = fit_second(pointers_to(seconds));
  report_cost(seconds, fit.model);
  print_table_head("core/choice/second_look.h");
  fmt::print("inline constexpr SecondLookModel::Features kSecondSlopes{{{}}};\n", row_of(fit.model.slopes));
  print_table(fit, "SecondLookModel", "Second");
}

}  // namespace crease::quality
