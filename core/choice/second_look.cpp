#include "core/choice/second_look.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/choice/second_look_table.h"

namespace crease {
namespace {

using SecondFeatures = SecondLookModel::Features;

// Of Features: before the first are those of the noise, and the other hardly differs between results.
constexpr std::size_t kFirstOfResult = 11, kEdgeLengths = 18;
constexpr std::size_t kCompared = 4 + kLookFeatures;

double log_of_angle(double degrees) {
  constexpr double kLeastDeg = 0.02;
  return std::log(degrees + kLeastDeg);
}

double is_organic(const TriedSetting& tried) {
  return kSettings.at(tried.setting).family.name == family::kOrganic ? 1 : 0;
}

}  // namespace

Look look_of(const Features& features) {
  Look look{};
  std::size_t known = 0;
  for (std::size_t k = kFirstOfResult; k < features.size(); ++k) {
    if (k != kEdgeLengths) look.at(known++) = features.at(k);
  }
  return look;
}

double mean_angle_deg(std::span<const float> some, std::span<const float> others) {
  const std::vector<float> cosines = products(some, others);
  double sum = 0;
  for (const float cosine : cosines) sum += static_cast<double>(std::acos(std::clamp(cosine, -1.0F, 1.0F)));
  return sum / static_cast<double>(cosines.size()) * 180 / std::numbers::pi;
}

std::vector<std::size_t> likely_settings(const SettingErrors& errors, std::size_t most) {
  std::vector<std::size_t> order(errors.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return errors[i]; });
  const double worst = errors[order.front()] + kLikely;
  std::erase_if(order, [&](std::size_t i) { return errors[i] > worst; });
  order.resize(std::min(order.size(), most));
  return order;
}

std::vector<TriedSetting> try_settings(std::span<const std::size_t> settings, const SettingErrors& expected,
                                       const FlatMesh& mesh, const Evidence& evidence, const Solve& solve) {
  std::vector<TriedSetting> tried;
  std::vector<FlatVectors> normals;
  for (const std::size_t i : settings) {
    const GraduatedOptions options = evidence.sight.options(kSettings.at(i), evidence.variance, false);
    Candidate candidate;
    candidate.result = solve({mesh, mesh.measured, options, evidence.precisions, {}});
    score_residuals(candidate, mesh, evidence.precisions, false);
    tried.push_back({i, expected.at(i), look_of(features_of(mesh, evidence, candidate)),
                     mean_angle_deg(candidate.result.vertex_normals, evidence.reference.result.vertex_normals)});
    normals.push_back(std::move(candidate.result.vertex_normals));
  }
  for (std::size_t k = 0; k < tried.size(); ++k) {
    for (const FlatVectors& others : normals) {
      tried[k].from_others += mean_angle_deg(normals[k], others) / static_cast<double>(tried.size());
    }
  }
  return tried;
}

double SecondLookModel::along_slopes(const Description& description) const {
  double error = 0;
  for (std::size_t k = 0; k < slopes.size(); ++k) error += slopes[k] * description[k] / kStepsPerDeviation;
  return error;
}

double SecondLookModel::expected_error(const Features& features) const {
  return along_slopes(described(features)) + expected(features)[0];
}

std::vector<SecondFeatures> second_features(const Features& first, std::span<const TriedSetting> tried) {
  std::vector<SecondFeatures> all;
  for (const TriedSetting& setting : tried) {
    SecondFeatures& features = all.emplace_back();
    features[0] = setting.expected_error;
    features[1] = log_of_angle(setting.from_others);
    features[2] = log_of_angle(setting.from_reference);
    features[3] = is_organic(setting);
    std::ranges::copy(setting.look, features.begin() + 4);
    std::ranges::copy(first, features.begin() + kCompared);
    features[kCompared + kFeatures] = is_organic(setting);
    features[kCompared + kFeatures + 1] = log_of_angle(setting.from_others);
  }
  for (std::size_t k = 0; k < kCompared; ++k) {
    double mean = 0;
    for (const SecondFeatures& features : all) mean += features[k] / static_cast<double>(all.size());
    for (SecondFeatures& features : all) features[k] -= mean;
  }
  return all;
}

const SecondLookModel kSecondLook{{kSecondFeatureMeans, kSecondFeatureDeviations, kSecondMeanErrors, kSecondLandmarks},
                                  kSecondSlopes};

}  // namespace crease
