#include "proto/parameter_table.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "core/error.h"

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
  return {"", ""};
}

std::string code_of(std::string_view name, std::string_view text) {
  v1::Parameters parameters;
  return std::string(error_of([&] { set_parameter(parameters, name, text); }).code());
}

const ParameterInfo& info(std::string_view name) {
  for (const ParameterInfo& row : parameter_table()) {
    if (row.name == name) return row;
  }
  throw std::out_of_range(std::string(name));
}

/// A property of the schema as text that set_parameter takes.
std::string text_of(const nlohmann::ordered_json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

TEST(ParameterTable, HasARowForEveryFieldOfTheSchema) {
  const auto* descriptor = v1::Parameters::descriptor();
  ASSERT_EQ(parameter_table().size(), static_cast<std::size_t>(descriptor->field_count()));
  for (const ParameterInfo& row : parameter_table()) {
    EXPECT_NE(descriptor->FindFieldByName(row.name), nullptr);
    EXPECT_TRUE(descriptor->FindFieldByName(row.name)->has_presence()) << row.name;
    EXPECT_FALSE(row.meaning.empty()) << row.name;
    EXPECT_FALSE(row.default_text.empty()) << row.name;
    const bool number = row.type == ParameterType::kInteger || row.type == ParameterType::kNumber;
    EXPECT_EQ(number, row.min < row.max) << row.name;
    EXPECT_EQ(row.type == ParameterType::kString, !row.values.empty()) << row.name;
  }
}

TEST(ParameterTable, DefaultsAreThoseOfCore) {
  v1::Parameters parameters;
  parameters.set_threads(SmoothOptions{}.threads);
  v1::Parameters resolved = resolve(parameters);
  resolved.set_threads(0);  // 0 resolves to what the machine has
  const auto of_schema = option_values(to_options(resolved));
  const auto of_core = option_values(SmoothOptions{});
  ASSERT_EQ(of_schema.size(), of_core.size());
  for (std::size_t i = 0; i < of_core.size(); ++i) {
    EXPECT_EQ(of_schema[i].first, of_core[i].first);
    const auto* number = std::get_if<double>(&of_core[i].second);
    if (number != nullptr) {
      EXPECT_DOUBLE_EQ(std::get<double>(of_schema[i].second), *number) << of_core[i].first;
    } else {
      EXPECT_EQ(of_schema[i].second, of_core[i].second) << of_core[i].first;
    }
  }
}

TEST(ParameterTable, EveryOptionOfCoreIsAParameterAndBack) {
  std::set<std::string> options;
  for (const std::string& word : info("method").values) {
    SmoothOptions of_method;
    set_option(of_method, "method", word);
    for (const auto& [name, value] : option_values(of_method)) options.insert(name);
  }
  for (const std::string& name : parameter_names()) {
    if (is_of_service(name)) options.insert(name);
  }
  EXPECT_THAT(parameter_names(), testing::UnorderedElementsAreArray(options));
}

TEST(SetParameter, TakesTheEndsOfEachRangeAndNothingBeyond) {
  for (const ParameterInfo& row : parameter_table()) {
    if (row.type != ParameterType::kInteger && row.type != ParameterType::kNumber) continue;
    v1::Parameters parameters;
    for (const double end : {row.min, row.max}) {
      EXPECT_NO_THROW(set_parameter(parameters, row.name, fmt::format("{}", end))) << row.name;
    }
    const bool whole = row.type == ParameterType::kInteger;
    EXPECT_EQ(code_of(row.name, fmt::format("{}", whole ? row.min - 1 : row.min - 1e-3)), code::kParameterOutOfRange);
    EXPECT_EQ(code_of(row.name, fmt::format("{}", row.max + 1)), code::kParameterOutOfRange);
    EXPECT_EQ(code_of(row.name, fmt::format("{}9", row.max)), code::kParameterOutOfRange);
  }
}

TEST(SetParameter, TakesOnlyTheWordsOfTheTable) {
  for (const ParameterInfo& row : parameter_table()) {
    if (row.type != ParameterType::kString) continue;
    v1::Parameters parameters;
    for (const std::string& word : row.values) EXPECT_NO_THROW(set_parameter(parameters, row.name, word));
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

TEST(Resolve, RefusesAStepThatTaubinsFilterCannotTake) {
  v1::Parameters given;
  given.set_flow_step(0.66);
  EXPECT_NO_THROW(resolve(given));  // another method's step
  given.set_method("taubin");
  try {
    resolve(given);
    FAIL() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code::kParameterOutOfRange);
    EXPECT_NE(error.detail().find("flow_step"), std::string::npos);
  }
  given.set_flow_step(0.65);
  EXPECT_NO_THROW(resolve(given));
}

TEST(Resolve, KeepsWhatIsGivenAndSetsTheRest) {
  v1::Parameters given;
  given.set_sweeps(7);
  given.set_threads(3);
  const v1::Parameters resolved = resolve(given);
  EXPECT_EQ(resolved.sweeps(), 7U);
  EXPECT_EQ(resolved.threads(), 3U);
  EXPECT_EQ(resolved.process(), "both");
  EXPECT_EQ(resolved.solver(), "metropolis");
  EXPECT_EQ(resolved.likelihood_weight(), std::stod(info("likelihood_weight").default_text));
  for (const ParameterInfo& row : parameter_table()) {
    const auto* field = v1::Parameters::descriptor()->FindFieldByName(row.name);
    EXPECT_TRUE(resolved.GetReflection()->HasField(resolved, field)) << row.name;
  }
  EXPECT_GE(resolve({}).threads(), 1U);
  EXPECT_EQ(resolve(resolved).SerializeAsString(), resolved.SerializeAsString());
}

TEST(ToOptions, CarriesEveryParameterIntoCore) {
  v1::Parameters parameters;
  parameters.set_sweeps(5);
  parameters.set_edge_process(false);
  parameters.set_smoothness("square_root");
  parameters.set_sharpness_threshold_deg(90);
  const auto options = std::get<MrfOptions>(to_options(resolve(parameters)).method);
  EXPECT_EQ(options.sweeps, 5U);
  EXPECT_FALSE(options.edge_process);
  EXPECT_EQ(options.smoothness, Smoothness::kSquareRoot);
  EXPECT_NEAR(options.sharpness_threshold, 1.5707963267948966, 1e-15);
}

TEST(ParametersSchema, DescribesEveryParameterWithADefaultThatIsTaken) {
  const auto schema = parameters_schema();
  EXPECT_EQ(schema.at("type"), "object");
  EXPECT_EQ(schema.at("additionalProperties"), false);
  ASSERT_EQ(schema.at("properties").size(), parameter_table().size());
  v1::Parameters defaults;
  for (const auto& [name, property] : schema.at("properties").items()) {
    EXPECT_NO_THROW(set_parameter(defaults, name, text_of(property.at("default")))) << name;
    EXPECT_EQ(property.at("description"), info(name).meaning);
    EXPECT_EQ(property.value("x-unit", ""), info(name).unit);
  }
  EXPECT_EQ(resolve(defaults).SerializeAsString(), resolve({}).SerializeAsString());
  EXPECT_EQ(schema["properties"]["sweeps"]["type"], "integer");
  EXPECT_EQ(schema["properties"]["seed"]["maximum"], std::numeric_limits<std::uint32_t>::max());
  EXPECT_EQ(schema["properties"]["edge_process"]["type"], "boolean");
  EXPECT_EQ(schema["properties"]["smoothness"]["enum"], (json{"quadratic", "square_root", "huber", "truncated"}));
}

TEST(ChangesResult, AllButThreadsAndRetention) {
  for (const std::string& name : parameter_names()) {
    EXPECT_EQ(changes_result(name), name != "threads" && name != "retention_hours") << name;
  }
}

}  // namespace
}  // namespace crease
