#include "proto/parameter_table.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "core/error.h"
#include "proto/convert.h"

namespace crease {
namespace {

using nlohmann::json;

/// The error of `action`; fails when there is none.
Error error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "accepted";
  return {code::kInternal, ""};
}

ErrorCode code_of(std::string_view name, std::string_view text) {
  v1::Parameters parameters;
  return error_of([&] { set_parameter(parameters, name, text); }).code();
}

/// A property of the schema as text that set_parameter takes.
std::string text_of_json(const nlohmann::ordered_json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

bool is_number(const Parameter& parameter) {
  return parameter.type() == ParameterType::kInteger || parameter.type() == ParameterType::kNumber;
}

v1::Parameters parameters_of(const std::vector<std::pair<std::string, std::string>>& assignments) {
  v1::Parameters given;
  for (const auto& [name, value] : assignments) set_parameter(given, name, value);
  return given;
}

TEST(SetParameter, TakesTheEndsOfEachRangeAndNothingBeyond) {
  for (const Parameter& row : parameter_table()) {
    if (!is_number(row)) continue;
    v1::Parameters parameters;
    for (const double end : {row.min(), row.max()}) {
      EXPECT_NO_THROW(set_parameter(parameters, row.name, fmt::format("{}", end))) << row.name;
    }
    const bool whole = row.type() == ParameterType::kInteger;
    const double below = row.min() - (whole ? 1 : 1e-3);
    EXPECT_EQ(code_of(row.name, fmt::format("{}", below)), code::kParameterOutOfRange) << row.name;
    EXPECT_EQ(code_of(row.name, fmt::format("{}", row.max() + 1)), code::kParameterOutOfRange);
    EXPECT_EQ(code_of(row.name, fmt::format("{}9", row.max())), code::kParameterOutOfRange);
  }
}

TEST(SetParameter, TakesOnlyTheWordsOfTheTable) {
  for (const Parameter& row : parameter_table()) {
    if (row.type() != ParameterType::kWord) continue;
    v1::Parameters parameters;
    for (const std::string_view word : row.words()) EXPECT_NO_THROW(set_parameter(parameters, row.name, word));
    for (const std::string text : {"", "Quadratic", "quadratic ", "1"}) {
      EXPECT_EQ(code_of(row.name, text), code::kParameterInvalid) << row.name << " = " << text;
    }
  }
}

TEST(SetParameter, ReadsTheWholeTextOrRefusesIt) {
  for (const std::string text : {"", " 3", "3 ", "+3", "3x", "0x10", "nan", "inf", "-inf", "1e", "--1", "1,5"}) {
    EXPECT_EQ(code_of("step_size", text), code::kParameterInvalid) << text;
    EXPECT_EQ(code_of("sweeps", text), code::kParameterInvalid) << text;
  }
  for (const std::string text : {"3.0", "3.5", "1e2"}) EXPECT_EQ(code_of("sweeps", text), code::kParameterInvalid);
  for (const std::string text : {"True", "1", "yes", ""}) {
    EXPECT_EQ(code_of("edge_process", text), code::kParameterInvalid) << text;
  }
  EXPECT_EQ(code_of("step_size", "1e999"), code::kParameterOutOfRange);
  EXPECT_EQ(code_of("seed", "99999999999999999999999"), code::kParameterOutOfRange);

  v1::Parameters parameters;
  set_parameter(parameters, "edge_process", "false");
  set_parameter(parameters, "step_size", "2.5e-1");
  set_parameter(parameters, "seed", "4294967295");
  EXPECT_FALSE(parameters.edge_process());
  EXPECT_EQ(parameters.step_size(), 0.25);
  EXPECT_EQ(parameters.seed(), std::numeric_limits<std::uint32_t>::max());
}

TEST(SetParameter, ErrorsNameFieldValueAndRange) {
  v1::Parameters parameters;
  const Error range = error_of([&] { set_parameter(parameters, "sharpness_threshold_deg", "181"); });
  EXPECT_EQ(range.code(), code::kParameterOutOfRange);
  EXPECT_EQ(range.field(), "sharpness_threshold_deg");
  EXPECT_EQ(range.value(), "181");
  EXPECT_EQ(range.expected(), "a number from 0 to 180");

  const Error word = error_of([&] { set_parameter(parameters, "smoothness", "cubic"); });
  EXPECT_EQ(word.expected(), "one of quadratic, square_root, huber, truncated");

  const Error unknown = error_of([&] { set_parameter(parameters, "smoothnes", "quadratic"); });
  EXPECT_EQ(unknown.code(), code::kParameterUnknown);
  EXPECT_EQ(unknown.field(), "smoothnes");
  EXPECT_THAT(unknown.expected(), testing::HasSubstr("smoothness"));
}

TEST(SetParameter, ErrorsStayShortWhateverWasSent) {
  const std::string long_text(1'000'000, 'x');
  v1::Parameters parameters;
  for (const auto& [name, value] : {std::pair<std::string, std::string>{"seed", long_text}, {long_text, "1"}}) {
    const Error error = error_of([&, n = name, v = value] { set_parameter(parameters, n, v); });
    EXPECT_LT(error.detail().size(), 2000U);
  }
}

TEST(ParametersFromJson, ReadsEachTypeAndNoOther) {
  const v1::Parameters parameters = parameters_from_json(
      {{"sweeps", 12}, {"step_size", 1}, {"support_weight", 0.25}, {"edge_process", false}, {"method", "mrf"}});
  EXPECT_EQ(parameters.sweeps(), 12U);
  EXPECT_EQ(parameters.step_size(), 1.0);
  EXPECT_EQ(parameters.support_weight(), 0.25);
  EXPECT_FALSE(parameters.edge_process());
  EXPECT_EQ(parameters.method(), "mrf");
  EXPECT_FALSE(parameters.has_seed());

  const std::vector<json> invalid = {{{"sweeps", "12"}},     {{"sweeps", 12.5}},
                                     {{"step_size", "0.1"}}, {{"edge_process", "no"}},
                                     {{"edge_process", 1}},  {{"method", 1}},
                                     {{"seed", nullptr}},    {{"seed", json::array({1})}},
                                     json::array(),          json(3)};
  for (const json& object : invalid) {
    EXPECT_EQ(error_of([&] { parameters_from_json(object); }).code(), code::kParameterInvalid) << object;
  }
  EXPECT_EQ(error_of([] { parameters_from_json({{"sweeps", -1}}); }).code(), code::kParameterOutOfRange);
  EXPECT_EQ(error_of([] { parameters_from_json({{"sweep", 1}}); }).code(), code::kParameterUnknown);
}

TEST(Validate, RefusesWhatAMessageHoldsOutOfRange) {
  EXPECT_NO_THROW(validate({}));
  EXPECT_NO_THROW(validate(resolve({})));
  v1::Parameters parameters;
  parameters.set_step_size(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(error_of([&] { validate(parameters); }).code(), code::kParameterInvalid);
  parameters.set_step_size(-1);
  EXPECT_EQ(error_of([&] { validate(parameters); }).field(), "step_size");
  parameters.clear_step_size();
  parameters.set_sweeps(0);
  EXPECT_EQ(error_of([&] { validate(parameters); }).code(), code::kParameterOutOfRange);
  parameters.clear_sweeps();
  parameters.set_solver("newton");
  EXPECT_EQ(error_of([&] { validate(parameters); }).code(), code::kParameterInvalid);
  v1::Parameters unknown;
  unknown.GetReflection()->MutableUnknownFields(&unknown)->AddVarint(999, 1);
  EXPECT_EQ(error_of([&] { validate(unknown); }).code(), code::kParameterUnknown);
}

TEST(Resolve, RefusesWhatOnlyOtherMethodsTake) {
  v1::Parameters given = parameters_of({{"flow_step", "0.66"}});
  EXPECT_NO_THROW(resolve(given)) << "not used";
  given.set_method("mean_curvature_flow");
  EXPECT_NO_THROW(resolve(given));
  given.set_method("taubin");
  const Error error = error_of([&] { resolve(given); });
  EXPECT_EQ(error.code(), code::kParameterOutOfRange);
  EXPECT_EQ(error.field(), "flow_step");
  EXPECT_EQ(error.value(), "0.66");
  EXPECT_EQ(error.expected(), "a number from 0.0001 to 0.65 with method=taubin");
  given.set_flow_step(0.65);
  EXPECT_NO_THROW(resolve(given));
}

TEST(Resolve, KeepsWhatIsGivenAndSetsTheRestThatMatters) {
  const v1::Parameters resolved = resolve(parameters_of({{"sweeps", "7"}, {"threads", "3"}}));
  EXPECT_EQ(resolved.sweeps(), 7U);
  EXPECT_EQ(resolved.threads(), 3U);
  EXPECT_EQ(resolved.process(), "both");
  EXPECT_EQ(resolved.solver(), "metropolis");
  EXPECT_EQ(resolved.likelihood_weight(), MrfOptions{}.likelihood_weight);
  EXPECT_EQ(resolved.sharpness_threshold_deg(), 46.0);
  EXPECT_TRUE(resolved.has_retention_hours());
  EXPECT_FALSE(resolved.has_likelihood_width());
  EXPECT_FALSE(resolved.has_iterations());
  EXPECT_EQ(resolve(resolved).SerializeAsString(), resolved.SerializeAsString());
}

TEST(Resolve, LeavesNothingAutomatic) {
  const v1::Parameters resolved = resolve(parameters_of({{"process", "auto"}, {"solver", "auto"}, {"threads", "0"}}));
  EXPECT_FALSE(resolved.has_process());
  EXPECT_EQ(resolved.solver(), "descent");
  EXPECT_GE(resolved.threads(), 1U);
  EXPECT_EQ(resolve({}).SerializeAsString(), resolved.SerializeAsString());
}

TEST(Resolve, AParameterOfTheSamplerAsksForTheSampler) {
  for (const auto& [name, value] : {std::pair{"sweeps", "7"}, {"process", "face"}, {"likelihood", "huber"}}) {
    EXPECT_EQ(resolve(parameters_of({{name, value}})).solver(), "metropolis") << name;
  }
  for (const auto& [name, value] : {std::pair{"seed", "7"}, {"strength", "0.5"}, {"threads", "1"}}) {
    EXPECT_EQ(resolve(parameters_of({{name, value}})).solver(), "descent") << name;
  }
}

TEST(Resolve, ListsTheOptionsOfTheMethodAlone) {
  const auto of_taubin = to_json(resolve(parameters_of({{"method", "taubin"}, {"threads", "1"}})));
  EXPECT_EQ(
      of_taubin.dump(),
      R"({"method":"taubin","threads":1,"iterations":15,"flow_step":0.6307,"passband":0.1,"retention_hours":24,"weld_tolerance":0})");
}

TEST(Resolve, WarnsOfWhatIsNotUsed) {
  std::vector<Warning> warnings;
  const v1::Parameters given =
      parameters_of({{"likelihood_width", "0.5"}, {"passband", "0.2"}, {"solver", "descent"}, {"sweeps", "3"}});
  const v1::Parameters resolved = resolve(given, &warnings);
  ASSERT_EQ(warnings.size(), 3U);
  for (const Warning& warning : warnings) EXPECT_EQ(warning.code, "parameter_not_used");
  EXPECT_EQ(warnings[0].detail,
            "parameter 'sweeps' is '3' and is not used: it matters only with method=mrf, "
            "solver=metropolis");
  EXPECT_THAT(warnings[1].detail, testing::HasSubstr("'likelihood_width' is '0.5'"));
  EXPECT_THAT(warnings[1].detail, testing::HasSubstr("likelihood=huber"));
  EXPECT_THAT(warnings[2].detail, testing::HasSubstr("method=taubin"));
  EXPECT_FALSE(resolved.has_sweeps());
  EXPECT_FALSE(resolved.has_passband());

  warnings.clear();
  resolve(parameters_of({{"likelihood", "huber"}, {"likelihood_width", "0.5"}, {"seed", "3"}}), &warnings);
  EXPECT_TRUE(warnings.empty());
}

TEST(Resolve, AConditionOnAParameterThatIsNotUsedDoesNotHold) {
  std::vector<Warning> warnings;
  resolve(parameters_of({{"process", "face"}, {"likelihood", "huber"}, {"likelihood_width", "0.5"}}), &warnings);
  EXPECT_EQ(warnings.size(), 2U);
}

TEST(ToOptions, CarriesEveryParameterIntoCore) {
  const auto options = std::get<MrfOptions>(
      to_options(
          parameters_of(
              {{"sweeps", "5"}, {"edge_process", "false"}, {"smoothness", "square_root"}, {"curvature_weight", "2"}}))
          .method);
  EXPECT_EQ(options.sweeps, 5U);
  EXPECT_FALSE(options.edge_process);
  EXPECT_EQ(options.smoothness, Smoothness::kSquareRoot);
  EXPECT_EQ(options.curvature_weight, 2.0);
  const auto sharp = to_options(parameters_of({{"sharpness_threshold_deg", "90"}}));
  EXPECT_NEAR(std::get<MrfOptions>(sharp.method).sharpness_threshold, 1.5707963267948966, 1e-15);
  const auto diebel = to_options(parameters_of({{"method", "diebel"}, {"diebel_weight", "3"}}));
  EXPECT_EQ(std::get<DiebelOptions>(diebel.method).likelihood_weight, 3.0);
}

TEST(ParametersSchema, DescribesEveryParameterWithADefaultThatIsAccepted) {
  const auto schema = parameters_schema();
  EXPECT_EQ(schema.at("type"), "object");
  EXPECT_EQ(schema.at("additionalProperties"), false);
  ASSERT_EQ(schema.at("properties").size(), parameter_table().size());
  v1::Parameters defaults;
  for (const auto& [name, property] : schema.at("properties").items()) {
    EXPECT_NE(property.contains("default"), property.contains("x-defaults")) << name;
    if (property.contains("default")) {
      EXPECT_NO_THROW(set_parameter(defaults, name, text_of_json(property["default"]))) << name;
    }
  }
  EXPECT_EQ(resolve(defaults).SerializeAsString(), resolve({}).SerializeAsString());
  EXPECT_EQ(schema["properties"]["sweeps"]["type"], "integer");
  EXPECT_EQ(schema["properties"]["seed"]["maximum"], std::numeric_limits<std::uint32_t>::max());
  EXPECT_EQ(schema["properties"]["edge_process"]["type"], "boolean");
  EXPECT_EQ(schema["properties"]["smoothness"]["enum"],
            (nlohmann::ordered_json{"quadratic", "square_root", "huber", "truncated"}));
  EXPECT_EQ(schema["properties"]["process"]["default"], "both");
  EXPECT_EQ(schema["properties"]["process"]["enum"], (nlohmann::ordered_json{"auto", "vertex", "face", "both"}));
}

TEST(ParametersSchema, SaysWhereAParameterMattersAndWhatDiffersByMethod) {
  const auto properties = parameters_schema().at("properties");
  EXPECT_EQ(properties["rounds"]["x-applies"].dump(), R"({"method":["mrf"],"process":["face","both"]})");
  EXPECT_EQ(properties["rounds"]["x-group"], "Face process");
  EXPECT_EQ(properties["rounds"]["x-unit"], "rounds");
  EXPECT_FALSE(properties["threads"].contains("x-applies"));
  EXPECT_EQ(properties["spatial_width"]["x-defaults"].dump(), R"({"non_iterative":1.5,"bilateral":1.0})");
  EXPECT_FALSE(properties["spatial_width"].contains("x-ranges"));
  EXPECT_EQ(properties["flow_step"]["x-ranges"]["taubin"]["maximum"], 0.65);
  EXPECT_EQ(properties["flow_step"]["maximum"], 1000.0);
}

TEST(ParametersSchema, HasTheDefaultsAndMaximaOfTheOperator) {
  OperatorSettings settings;
  settings.defaults.set_retention_hours(2);
  settings.maxima.set_retention_hours(48);
  const auto retention = parameters_schema(settings).at("properties").at("retention_hours");
  EXPECT_EQ(retention["default"], 2.0);
  EXPECT_EQ(retention["maximum"], 48.0);
}

}  // namespace
}  // namespace crease
