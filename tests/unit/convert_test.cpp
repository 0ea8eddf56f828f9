#include "proto/convert.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "core/error.h"
#include "core/features/features.h"
#include "proto/parameter_table.h"
#include "tests/support/labelled_meshes.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

std::vector<std::string> keys(const nlohmann::ordered_json& object) {
  std::vector<std::string> names;
  for (const auto& [name, value] : object.items()) names.push_back(name);
  return names;
}

LabelledMesh distinctly_labelled(const Mesh& mesh) {
  LabelledMesh result{.mesh = mesh, .edges = build_topology(mesh).edges, .labels = {}, .dihedral_rad = {}};
  for (std::size_t e = 0; e < result.edges.size(); ++e) {
    result.labels.push_back(1.0 / static_cast<double>(e + 1));
    result.dihedral_rad.push_back(static_cast<double>(e) - 0.1);
  }
  return result;
}

TEST(Sha256, AgreesWithThePublishedExamples) {
  EXPECT_EQ(sha256_hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256_hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(LabelledMeshMessage, PreservesEveryMeshBitForBit) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : test::mesh_family()) {
    const LabelledMesh before = distinctly_labelled(mesh);
    v1::LabelledMesh parsed;
    ASSERT_TRUE(parsed.ParseFromString(to_message(before).SerializeAsString()));
    const LabelledMesh after = from_message(parsed);
    EXPECT_EQ(after.mesh.positions, before.mesh.positions) << name;
    EXPECT_EQ(after.mesh.triangles, before.mesh.triangles) << name;
    EXPECT_EQ(after.edges, before.edges) << name;
    EXPECT_EQ(after.labels, before.labels) << name;
    EXPECT_EQ(after.dihedral_rad, before.dihedral_rad) << name;
  }
}

TEST(LabelledMeshMessage, PreservesFeatures) {
  for (const auto& member : test::mesh_family()) {
    SCOPED_TRACE(member.name);
    LabelledMesh before = test::labelled(member.mesh);
    Features features = find_features(before.mesh, build_topology(before.mesh), before.mesh.positions, before.labels);
    before.classes = std::move(features.classes);
    before.sigma.assign(member.mesh.positions.size(), 0.25);
    before.segments = std::move(features.segments);
    before.ridge_lines = std::move(features.ridge_lines);
    before.corners = std::move(features.corners);
    v1::LabelledMesh parsed;
    ASSERT_TRUE(parsed.ParseFromString(to_message(before).SerializeAsString()));
    const LabelledMesh after = from_message(parsed);
    EXPECT_EQ(after.classes, before.classes);
    EXPECT_EQ(after.sigma, before.sigma);
    EXPECT_EQ(after.segments, before.segments);
    EXPECT_EQ(after.corners, before.corners);
    ASSERT_EQ(after.ridge_lines.size(), before.ridge_lines.size());
    EXPECT_EQ(write_ridges_json(after, {}), write_ridges_json(before, {}));
    for (std::size_t i = 0; i < after.ridge_lines.size(); ++i) {
      EXPECT_EQ(after.ridge_lines[i].mean_dihedral_rad, before.ridge_lines[i].mean_dihedral_rad);
    }
  }
}

TEST(LabelledMeshMessage, RefusesFeaturesThatDoNotFit) {
  const v1::LabelledMesh good = to_message(distinctly_labelled(test::cube(1)));
  const std::vector<std::function<void(v1::LabelledMesh&)>> faults = {
      [](auto& message) { message.add_classes(0); },  [](auto& message) { message.mutable_classes()->Resize(8, 3); },
      [](auto& message) { message.add_segments(0); }, [](auto& message) { message.add_sigma(0); },
      [](auto& message) { message.add_corners(8); },  [](auto& message) { message.add_ridge_lines()->add_vertices(8); },
  };
  for (const auto& spoil : faults) {
    v1::LabelledMesh message = good;
    spoil(message);
    EXPECT_THROW(from_message(message), Error);
  }
}

TEST(FactsMessages, PreserveEveryFact) {
  InputFacts input;
  input.vertices = 8;
  input.flipped_faces = 3;
  input.noise_sigma = 0.25;
  EXPECT_EQ(to_message(from_message(to_message(input))).SerializeAsString(), to_message(input).SerializeAsString());
  const ResultFacts result{.ridge_edges = 1,
                           .ridge_length = 2,
                           .ridge_lines = 3,
                           .corners = 4,
                           .segments = 5,
                           .max_displacement = 6,
                           .rms_displacement = 7,
                           .volume_change = 8,
                           .seconds = 9,
                           .choice = {},
                           .other_choices = {},
                           .uncertainty = {}};
  const v1::ResultFacts message = to_message(result);
  EXPECT_EQ(message.ridge_lines(), 3U);
  EXPECT_EQ(to_message(from_message(message)).SerializeAsString(), message.SerializeAsString());
  ResultFacts chosen = result;
  chosen.choice.emplace().candidates.emplace_back().family = "flats";
  chosen.other_choices.emplace_back().faces = 600;
  chosen.uncertainty = {.mean = 0.1, .median = 0.05, .max = 0.4};
  const v1::ResultFacts with_choice = to_message(chosen);
  EXPECT_EQ(with_choice.uncertainty().median(), 0.05);
  EXPECT_EQ(static_cast<int>(to_json(with_choice).size()), v1::ResultFacts::descriptor()->field_count());
  EXPECT_EQ(static_cast<int>(to_json(with_choice)["choice"].size()), v1::Choice::descriptor()->field_count());
  EXPECT_EQ(with_choice.choice().candidates(0).surface(), "flats");
  ASSERT_EQ(with_choice.other_choices_size(), 1);
  EXPECT_EQ(with_choice.other_choices(0).faces(), 600U);
}

TEST(WarningMessages, AreAddedOnce) {
  v1::Job job;
  for (const std::string detail : {"a", "b", "a"})
    add_once(to_message(Warning{"code", detail}), *job.mutable_warnings());
  EXPECT_EQ(job.warnings_size(), 2);
}

TEST(LabelledMeshMessage, RefusesArraysThatDoNotFitTogether) {
  const v1::LabelledMesh good = to_message(distinctly_labelled(test::cube(1)));
  EXPECT_NO_THROW(from_message(good));
  v1::LabelledMesh message = good;
  message.add_positions(0);
  EXPECT_THROW(from_message(message), Error);
  message = good;
  message.add_labels(0);
  EXPECT_THROW(from_message(message), Error);
  message = good;
  message.set_triangles(0, 1'000'000);
  EXPECT_THROW(from_message(message), Error);
  message = good;
  message.set_edges(0, 1'000'000);
  EXPECT_THROW(from_message(message), Error);
}

TEST(ProgressMessage, GivesFractionAndTimeLeft) {
  SweepRecord record;
  record.sweep = 25;
  record.energy.of<LikelihoodTerm>() = 1;
  record.energy.of<SmoothnessTerm>() = 2;
  record.energy.of<SharpnessTerm>() = -4;
  record.energy.of<SupportTerm>() = 0.5;
  record.temperature = 0.125;
  record.acceptance = 0.5;
  const v1::Progress progress = to_message(SweepView{record, 100, 3.0, {}, {}});
  EXPECT_EQ(progress.fraction(), 0.25);
  EXPECT_EQ(progress.eta_seconds(), 9.0);
  EXPECT_EQ(progress.sweeps(), 100U);
  SweepView of_unlike_sweeps{record, 100, 3.0, {}, {}};
  of_unlike_sweeps.fraction = 0.75;
  EXPECT_EQ(to_message(of_unlike_sweeps).fraction(), 0.75);
  EXPECT_EQ(to_message(of_unlike_sweeps).eta_seconds(), 1.0);
  EXPECT_EQ(progress.temperature(), 0.125);
  EXPECT_EQ(progress.acceptance(), 0.5);
  EXPECT_EQ(progress.energy().smoothness(), 2);
  EXPECT_EQ(progress.energy().total(), -0.5);
}

TEST(ToJson, UsesTheNamesOfTheSchemaAndNumbers) {
  v1::InputFacts facts;
  facts.set_bytes(4294967295U);
  const auto json = to_json(facts);
  EXPECT_EQ(json.at("bytes"), 4294967295U);
  EXPECT_TRUE(json.at("bytes").is_number());
  EXPECT_EQ(json.at("boundary_edges"), 0);
  EXPECT_EQ(keys(json).size(), static_cast<std::size_t>(v1::InputFacts::descriptor()->field_count()));
  EXPECT_EQ(keys(json).front(), "name");
}

TEST(ToJson, OmitsUnsetFields) {
  v1::Job job;
  job.set_id("a");
  const auto json = to_json(job);
  EXPECT_FALSE(json.contains("started_at"));
  EXPECT_FALSE(json.contains("result"));
  EXPECT_FALSE(json.contains("error"));
  EXPECT_EQ(json.at("warnings"), nlohmann::ordered_json::array());
}

TEST(ToJson, KeepsEveryBitOfANumber) {
  v1::ResultFacts facts;
  for (const double value : {0.1, 1.0 / 3.0, 1e-300, 123456789.123456789, -2.5e17}) {
    facts.set_ridge_length(value);
    EXPECT_EQ(to_json(facts).at("ridge_length").get<double>(), value);
  }
}

TEST(JobFingerprint, DependsExactlyOnWhatChangesTheResult) {
  const v1::Parameters defaults = resolve({});
  const auto fingerprint = [](const std::string& sha256, const std::string& format, const std::string& weights,
                              const v1::Parameters& parameters) {
    v1::InputFacts input;
    input.set_sha256(sha256);
    input.set_format(format);
    input.set_weights_sha256(weights);
    return job_fingerprint(input, parameters);
  };
  const std::string base = fingerprint("aa", "obj", "", defaults);
  EXPECT_EQ(base.size(), 20U);
  EXPECT_EQ(base.find_first_not_of("0123456789abcdef"), std::string::npos);
  EXPECT_EQ(fingerprint("aa", "obj", "", defaults), base);

  v1::Parameters threads = defaults;
  threads.set_threads(17);
  EXPECT_EQ(fingerprint("aa", "obj", "", threads), base);

  std::set<std::string> all = {base, fingerprint("ab", "obj", "", defaults), fingerprint("aa", "ply", "", defaults),
                               fingerprint("aa", "obj", "cc", defaults)};
  std::size_t expected = all.size();
  for (const Parameter& parameter : parameter_table()) {
    if (parameter.type() != ParameterType::kInteger && parameter.type() != ParameterType::kNumber) continue;
    v1::Parameters changed = defaults;
    const std::string min = fmt::format("{}", parameter.min()), max = fmt::format("{}", parameter.max());
    set_parameter(changed, parameter.name, text_of(default_value(parameter, parameter.places[0])) == min ? max : min);
    all.insert(fingerprint("aa", "obj", "", changed));
    expected += parameter.changes_result ? 1 : 0;
  }
  EXPECT_EQ(all.size(), expected);
}

TEST(MeshExtras, NameTheJobItsParametersAndCounts) {
  InputFacts input;
  input.vertices = 8;
  input.faces = 12;
  ResultFacts result;
  result.ridge_edges = 3;
  result.seconds = 1.5;
  const auto extras = mesh_extras("abc", resolve({}), input, result);
  EXPECT_EQ(extras.at("job"), "abc");
  EXPECT_EQ(extras.at("counts").at("vertices"), 8);
  EXPECT_EQ(extras.at("counts").at("faces"), 12);
  EXPECT_EQ(extras.at("counts").at("ridge_edges"), 3);
  EXPECT_FALSE(extras.at("parameters").contains("threads"));
  EXPECT_FALSE(extras.at("parameters").contains("retention_hours"));
  EXPECT_EQ(extras.at("parameters").size() + 2, to_json(resolve({})).size());

  result.seconds = 2.5;
  EXPECT_EQ(mesh_extras("abc", resolve({}), input, result), extras);
}

}  // namespace
}  // namespace crease
