#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "core/base/thread_team.h"
#include "core/job.h"
#include "core/measure/noise.h"
#include "proto/parameter_table.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

using Assignments = std::vector<std::string>;

/// A value that differs from the default, and the settings under which the documentation says that it has an effect.
struct Effect {
  std::string name, value;
  std::vector<Assignments> contexts = {{}};
};

const std::vector<Assignments> kFace = {{"process=face", "rounds=2"}, {"process=both", "rounds=2"}};
const std::vector<Effect> kEffects = {
    {"method", "taubin"},
    {"process", "face"},
    {"solver", "descent"},
    {"sweeps", "21"},
    {"weld_tolerance", "0.5", {{}, {"method=taubin"}}},
    {"seed", "2", {{}, {"solver=descent"}}},
    {"strength", "2", {{"solver=descent"}}},
    {"noise", "isotropic", {{"solver=descent"}}},
    {"noise_sigma", "0.5", {{"solver=descent"}}},
    {"surface", "flats", {{"solver=descent"}}},
    {"uncertainty", "true", {{"solver=descent"}}},
    {"likelihood", "huber"},
    {"likelihood_weight", "0.5"},
    {"likelihood_weight_start", "1"},
    {"likelihood_width", "0.01", {{"likelihood=huber"}}},
    {"scan_direction_x", "1", {{"likelihood=anisotropic"}}},
    {"scan_direction_y", "1", {{"likelihood=anisotropic"}}},
    {"scan_direction_z", "1", {{"likelihood=anisotropic"}}},
    {"likelihood_across", "2", {{"likelihood=anisotropic"}}},
    {"volume_weight", "5", {{"likelihood=volume"}}},
    {"smoothness", "square_root"},
    {"smoothness_weight", "2"},
    {"smoothness_width_deg", "5", {{"smoothness=huber"}, {"smoothness=truncated"}}},
    {"curvature_weight", "0.5"},
    {"edge_process", "false"},
    {"sharpness_threshold_deg", "30"},
    {"sharpness_weight", "1.2"},
    {"support_weight", "0"},
    {"ridge_kind", "convex"},
    {"sharpness_limit_deg", "60"},
    {"continuity_weight", "1"},
    {"ridge_line_weight", "1"},
    {"rounds", "3", kFace},
    {"fit_steps", "5", kFace},
    {"normal_weight", "0.5", kFace},
    {"corner_weight", "0.5", kFace},
    {"normal_temperature_start", "0.1", kFace},
    {"normal_temperature_end", "0.005", kFace},
    {"label_temperature_start", "1"},
    {"label_temperature_end", "0.1"},
    {"vertex_temperature_start", "0.5"},
    {"vertex_temperature_end", "0.01"},
    {"step_size", "0.05", {{"process=vertex"}, {"process=face"}}},
    {"iterations",
     "2",
     {{"method=fuzzy_vector_median"},
      {"method=taubin"},
      {"method=mean_curvature_flow"},
      {"method=anisotropic_flow"},
      {"method=normal_diffusion"},
      {"method=bilateral"},
      {"method=diebel"}}},
    {"flow_step",
     "0.5",
     {{"method=taubin"}, {"method=mean_curvature_flow"}, {"method=anisotropic_flow"}, {"method=normal_diffusion"}}},
    {"passband", "0.2", {{"method=taubin"}}},
    {"spatial_width", "2", {{"method=bilateral"}, {"method=non_iterative"}}},
    {"range_width", "0.1", {{"method=bilateral"}, {"method=non_iterative"}}},
    {"normal_width_deg",
     "40",
     {{"method=fuzzy_vector_median"}, {"method=normal_diffusion"}, {"method=anisotropic_flow"}}},
    {"fitting_steps", "3", {{"method=fuzzy_vector_median"}, {"method=normal_diffusion"}}},
    {"diebel_weight", "5", {{"method=diebel"}}},
};

CheckedInput noisy_part(int resolution) {
  return check_mesh(add_noise(test::cad_part(resolution).mesh, 0.2, 1, NoiseKind::kNormal));
}

const CheckedInput& small_part() {
  static const CheckedInput input = noisy_part(2);
  return input;
}

v1::Parameters parameters(const Assignments& assignments) {
  v1::Parameters given;
  given.set_sweeps(20);
  for (const std::string& assignment : assignments) {
    const auto equals = assignment.find('=');
    set_parameter(given, assignment.substr(0, equals), assignment.substr(equals + 1));
  }
  return resolve(given);
}

struct Outcome {
  std::vector<Vec3> positions;
  std::vector<double> labels;
  std::vector<double> energies;
  std::vector<double> sigma;
  bool operator==(const Outcome&) const = default;
};

Outcome run(const SmoothOptions& options, const CheckedInput& input = small_part()) {
  RunContext context;
  JobOutput output = run_job(input, options, context);
  Outcome outcome{std::move(output.result.mesh.positions), std::move(output.result.labels), {}, {}};
  outcome.sigma = std::move(output.result.sigma);
  for (const SweepRecord& record : output.sweeps) outcome.energies.push_back(record.energy.total());
  return outcome;
}

Outcome run(const v1::Parameters& resolved) { return run(to_options(resolved)); }

/// What the same parameters gave before.
const Outcome& outcome(const Assignments& context) {
  static std::map<std::string, Outcome> known;
  const v1::Parameters resolved = parameters(context);
  const auto [entry, is_new] = known.try_emplace(resolved.SerializeAsString());
  if (is_new) entry->second = run(resolved);
  return entry->second;
}

TEST(ParameterEffect, EveryParameterThatChangesTheResultHasARow) {
  std::vector<std::string> rows, expected;
  for (const Effect& effect : kEffects) rows.push_back(effect.name);
  for (const Parameter& parameter : parameter_table()) {
    if (parameter.changes_result) expected.emplace_back(parameter.name);
  }
  EXPECT_THAT(rows, testing::UnorderedElementsAreArray(expected));
}

TEST(ParameterEffect, EveryParameterChangesTheResultWhereItIsDocumentedTo) {
  for (const Effect& effect : kEffects) {
    for (const Assignments& context : effect.contexts) {
      SCOPED_TRACE(effect.name + "=" + effect.value + " with " + testing::PrintToString(context));
      Assignments changed = context;
      changed.push_back(effect.name + "=" + effect.value);
      ASSERT_NE(parameters(changed).SerializeAsString(), parameters(context).SerializeAsString());
      EXPECT_FALSE(run(parameters(changed)) == outcome(context));
    }
  }
}

TEST(ParameterEffect, EveryWordOfAParameterGivesADifferentResult) {
  for (const Parameter& parameter : parameter_table()) {
    std::map<std::string_view, Outcome> found;
    for (const std::string_view word : parameter.places.front().words) {
      if (word == "estimated") continue;  // is one of the others, as the upload has it
      Assignments assignments = {fmt::format("{}={}", parameter.name, word)};
      for (const ParameterCondition& condition : parameter.conditions) {
        assignments.push_back(fmt::format("{}={}", condition.parameter, condition.words.front()));
      }
      Outcome result = run(parameters(assignments));
      for (const auto& [other, known] : found)
        EXPECT_FALSE(result == known) << parameter.name << ": " << word << ", " << other;
      found.emplace(word, std::move(result));
    }
  }
}

TEST(ParameterEffect, AParameterThatIsNotUsedWouldChangeNothing) {
  const std::vector<ParameterValues> contexts = {{{"process", "vertex"}},
                                                 {{"process", "face"}},
                                                 {{"noise_sigma", 0.2}, {"solver", "descent"}, {"surface", "flats"}},
                                                 {{"edge_process", false}},
                                                 {{"likelihood", "huber"}},
                                                 {{"smoothness", "truncated"}}};
  for (ParameterValues context : contexts) {
    std::string assignments;
    for (const auto& [name, value] : context) assignments += fmt::format("{}={} ", name, text_of(value));
    SCOPED_TRACE(assignments);
    context.emplace("sweeps", 20U);
    const ResolvedParameters resolved = resolve_parameters(context);
    const Outcome usual = run(resolved.options.smooth);
    for (const Effect& effect : kEffects) {
      const Parameter& parameter = find_parameter(effect.name);
      const ParameterPlace* place = parameter.place_for(resolved.options.smooth.method.index());
      if (place == nullptr || resolved.values.contains(effect.name)) continue;
      // Without labels, its weight decides only the order of visits.
      if (effect.name == "ridge_line_weight") continue;
      JobOptions changed = resolved.options;
      place->set(changed, parse_value(parameter, effect.value));
      EXPECT_TRUE(run(changed.smooth) == usual) << effect.name;
    }
  }
}

TEST(ParameterEffect, ThreadsChangeNothing) {
  const CheckedInput input = noisy_part(4);
  ASSERT_GE(input.mesh.triangles.size(), 3 * kSitesPerThread) << "or there are not three";
  for (const Assignments& context : {Assignments{}, {"process=face"}, {"solver=descent"}, {"method=diebel"}}) {
    Assignments one = context, three = context;
    one.emplace_back("threads=1");
    three.emplace_back("threads=3");
    EXPECT_TRUE(run(to_options(parameters(one)), input) == run(to_options(parameters(three)), input))
        << testing::PrintToString(context);
  }
}

}  // namespace
}  // namespace crease
