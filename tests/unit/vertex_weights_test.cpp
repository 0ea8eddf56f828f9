#include "core/io/vertex_weights.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "core/job.h"
#include "tests/support/meshes.h"
#include "tests/support/store_support.h"

namespace crease {
namespace {

template <typename Call>
Error error_of(Call&& call) {
  try {
    call();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "accepted";
  return {code::kInternal, ""};
}

Error refusal(const std::string& json, std::size_t vertices) {
  return error_of([&] { read_weights(json, vertices); });
}

TEST(ReadWeights, AcceptsNumbersFromZeroToTheLargest) {
  EXPECT_EQ(read_weights("[0, 1e6, 0.5, 1, 1000000, -0.0]", 6), (std::vector<double>{0, 1e6, 0.5, 1, 1e6, 0}));
  EXPECT_EQ(read_weights("[]", 0), std::vector<double>());
  EXPECT_EQ(read_weights(" \n[\t0.1 ] ", 1).front(), 0.1);
}

TEST(ReadWeights, NamesTheFirstInvalidItem) {
  struct Case {
    std::string json, field, value;
  };
  const std::string deep = "[1, " + std::string(1'000'000, '[');
  for (const auto& [json, field, value] : std::vector<Case>{{"[1, -1, -2]", "weights[1]", "-1"},
                                                            {"[1, 2, -1e-9]", "weights[2]", "-1e-09"},
                                                            {"[1000001, 1, 1]", "weights[0]", "1000001"},
                                                            {"[1, 1e999, 1]", "weights[1]", "1e999"},
                                                            {"[1, 99999999999999999999999]", "weights[1]", "1e+23"},
                                                            {"[1, \"1\", 1]", "weights[1]", "1"},
                                                            {"[1, null, 1]", "weights[1]", "null"},
                                                            {"[true, 1, 1]", "weights[0]", "true"},
                                                            {"[1, {\"a\": 1}]", "weights[1]", "an object"},
                                                            {"[[1, 1, 1]]", "weights[0]", "an array"},
                                                            {"[1, NaN, 1]", "weights[1]", "NaN"},
                                                            {"[1, 1, nan]", "weights[2]", "nan"},
                                                            {"[-Infinity, 1, 1]", "weights[0]", "-Infinity"},
                                                            {deep, "weights[1]", "an array"}}) {
    const Error error = refusal(json, 3);
    EXPECT_EQ(error.code(), code::kWeightsInvalid);
    EXPECT_EQ(error.field(), field) << json.substr(0, 50);
    EXPECT_EQ(error.value(), value) << json.substr(0, 50);
    EXPECT_EQ(error.expected(), "a number from 0 to 1000000");
  }
}

TEST(ReadWeights, RequiresOneForEveryVertex) {
  const Error few = refusal("[1, 2]", 3), many = refusal("[1, 2, 3, 4, 5]", 3);
  EXPECT_EQ(few.field(), "weights");
  EXPECT_EQ(few.value(), "2 numbers");
  EXPECT_EQ(many.field(), "weights[3]");
  EXPECT_EQ(many.value(), "4");
  for (const Error& error : {few, many}) EXPECT_EQ(error.expected(), "an array of 3 numbers, one per vertex");
}

TEST(ReadWeights, RefusesAnythingButAJsonArray) {
  for (const std::string json : {"", " ", "weights", "NaN", "[1, NaN, 1]", "[1, 1, 1", "[1, 1, 1],", "[1, 1, 1] 2", "1",
                                 "\"[1, 1, 1]\"", "{}", "null", "[1 1 1]", "[1,, 1]", "\xff\xfe"}) {
    const Error error = refusal(json, 3);
    EXPECT_EQ(error.code(), code::kWeightsInvalid) << json;
    EXPECT_TRUE(error.field().starts_with("weights")) << json;
    EXPECT_LT(error.detail().size(), 200U);
  }
}

TEST(IsWeight, IsFalseForNotANumber) {
  EXPECT_FALSE(is_weight(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_FALSE(is_weight(std::numeric_limits<double>::infinity()));
}

std::string ply(const std::string& format, const std::string& weight_type, const std::string& body) {
  return fmt::format(
      "ply\nformat {} 1.0\nelement vertex 3\nproperty float x\nproperty {} weight\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n{}",
      format, weight_type, body);
}

TEST(PlyWeights, ComeFromTheVertexPropertyOfAnyType) {
  const std::vector<double> expected{0, 7, 2};
  for (const std::string type : {"char", "uchar", "short", "ushort", "int", "uint", "float", "double"}) {
    const auto mesh = decode_mesh(ply("ascii", type, "0 0 0 0\n1 7 0 0\n0 2 1 0\n3 0 1 2\n"), MeshFormat::kPly);
    EXPECT_EQ(mesh.weights, expected);
    EXPECT_EQ(mesh.mesh.positions[2], Vec3(0, 1, 0));
  }
}

template <typename Number>
void append(std::string& bytes, Number number, bool big) {
  std::string raw(reinterpret_cast<const char*>(&number), sizeof(Number));
  bytes += big ? std::string(raw.rbegin(), raw.rend()) : raw;
}

template <typename Weight>
std::string binary_body(const std::vector<double>& weights, bool big) {
  std::string bytes;
  for (std::size_t v = 0; v < weights.size(); ++v) {
    append(bytes, v == 1 ? 1.0F : 0.0F, big);
    append(bytes, static_cast<Weight>(weights[v]), big);
    append(bytes, v == 2 ? 1.0F : 0.0F, big);
    append(bytes, 0.0F, big);
  }
  bytes += '\3';
  for (const std::int32_t corner : {0, 1, 2}) append(bytes, corner, big);
  return bytes;
}

TEST(PlyWeights, ComeFromBinaryFiles) {
  for (const bool big : {false, true}) {
    const std::string format = big ? "binary_big_endian" : "binary_little_endian";
    const auto weights = [&](const std::string& type, const std::string& body) {
      return decode_mesh(ply(format, type, body), MeshFormat::kPly).weights;
    };
    const std::vector<double> whole{0, 7, 2}, parts{0.5, 0.25, 1e6};
    EXPECT_EQ(weights("uchar", binary_body<std::uint8_t>(whole, big)), whole);
    EXPECT_EQ(weights("short", binary_body<std::int16_t>(whole, big)), whole);
    EXPECT_EQ(weights("float", binary_body<float>(parts, big)), parts);
    EXPECT_EQ(weights("double", binary_body<double>(parts, big)), parts);
  }
}

TEST(PlyWeights, AreRefusedWithTheirPlace) {
  for (const std::string weight : {"-1", "nan", "inf", "1000001"}) {
    const std::string body = "0 0 0 0\n1 " + weight + " 0 0\n0 2 1 0\n3 0 1 2\n";
    const Error error = error_of([&] { decode_mesh(ply("ascii", "double", body), MeshFormat::kPly); });
    EXPECT_EQ(error.code(), code::kWeightsInvalid);
    EXPECT_EQ(error.field(), "weights[1]");
    EXPECT_EQ(error.value(), weight);
    EXPECT_EQ(error.place(), "line 12");
  }
}

std::string base64(const std::string& bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      bits = bits << 8U | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : kDigits[bits >> (18 - 6 * k) & 63U];
  }
  return text;
}

/// A triangle as two primitives, the second `apart` from the first and with `_WEIGHT`, of three elements in `weights`.
std::string gltf(int component, bool normalized, const std::string& weights, const std::string& type = "SCALAR",
                 float apart = 5) {
  std::string positions;
  for (const float x : {0.0F, 1.0F, 0.0F, apart, 1 + apart, apart}) {
    append(positions, x, false);
    append(positions, positions.size() % 36 == 28 ? 1.0F : 0.0F, false);
    append(positions, 0.0F, false);
  }
  const std::string buffer = positions + weights;
  return fmt::format(
      R"({{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{},"uri":"data:application/octet-stream;base64,{}"}}],)"
      R"("bufferViews":[{{"buffer":0,"byteLength":72}},{{"buffer":0,"byteOffset":72,"byteLength":{}}}],)"
      R"("accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},)"
      R"({{"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"VEC3"}},)"
      R"({{"bufferView":1,"componentType":{},"normalized":{},"count":3,"type":"{}"}}],)"
      R"("meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}},)"
      R"({{"attributes":{{"POSITION":1,"_WEIGHT":2}}}}]}}],"nodes":[{{"mesh":0}}],"scenes":[{{"nodes":[0]}}]}})",
      buffer.size(), base64(buffer), weights.size(), component, normalized, type);
}

template <typename Number>
std::string packed(std::initializer_list<Number> numbers) {
  std::string bytes;
  for (const Number number : numbers) append(bytes, number, false);
  return bytes;
}

TEST(GltfWeights, ComeFromTheAttributeAndAreOneElsewhere) {
  const auto weights = [](const std::string& text) { return decode_mesh(text, MeshFormat::kGltf).weights; };
  EXPECT_EQ(weights(gltf(5126, false, packed({0.5F, 2.0F, 0.0F}))), (std::vector<double>{1, 1, 1, 0.5, 2, 0}));
  EXPECT_EQ(weights(gltf(5121, true, packed<std::uint8_t>({255, 51, 0}))), (std::vector<double>{1, 1, 1, 1, 0.2, 0}));
  EXPECT_EQ(weights(gltf(5123, true, packed<std::uint16_t>({65535, 0, 13107}))),
            (std::vector<double>{1, 1, 1, 1, 0, 0.2}));
  EXPECT_EQ(weights(gltf(5121, false, packed<std::uint8_t>({255, 1, 0}))), (std::vector<double>{1, 1, 1, 255, 1, 0}));
}

TEST(GltfWeights, OfVerticesThatAreWeldedAreThoseOfTheFirst) {
  const std::string weights = packed({0.5F, 2.0F, 0.0F});
  const auto one = decode_mesh(gltf(5126, false, weights, "SCALAR", 0), MeshFormat::kGltf);
  EXPECT_EQ(one.weights, (std::vector<double>{1, 1, 1}));
  // The second primitive's vertices lie one to the right: only its first lies where one of the others does.
  const auto beside = decode_mesh(gltf(5126, false, weights, "SCALAR", 1), MeshFormat::kGltf);
  EXPECT_EQ(beside.weights, (std::vector<double>{1, 1, 1, 2, 0}));
  EXPECT_EQ(beside.mesh.positions.size(), 5U);
}

TEST(GltfWeights, AreRefusedWithTheirPlace) {
  const auto refused = [](const std::string& text) { return error_of([&] { decode_mesh(text, MeshFormat::kGltf); }); };
  const Error negative = refused(gltf(5126, false, packed({0.5F, -2.0F, 0.0F})));
  EXPECT_EQ(negative.code(), code::kWeightsInvalid);
  EXPECT_EQ(negative.field(), "weights[4]");
  EXPECT_EQ(negative.place(), "accessor 2, element 1");
  EXPECT_EQ(refused(gltf(5122, true, packed<std::int16_t>({5, -5, 0}))).code(), code::kWeightsInvalid);
  EXPECT_EQ(refused(gltf(5126, false, packed({1.0F, std::nanf(""), 0.0F}))).code(), code::kWeightsInvalid);
  EXPECT_EQ(refused(gltf(5126, false, std::string(36, '\0'), "VEC3")).code(), code::kMeshSyntax);
}

TEST(CheckInput, TakesWeightsFromBesideTheMeshBeforeThoseInIt) {
  const std::string file = ply("ascii", "double", "0 0 0 0\n1 7 0 0\n0 2 1 0\n3 0 1 2\n");
  const CheckedInput alone = check_input(file, MeshFormat::kPly);
  EXPECT_EQ(alone.weights, (std::vector<double>{0, 7, 2}));
  const CheckedInput both = check_input(file, MeshFormat::kPly, {}, "[1, 2, 3]");
  EXPECT_EQ(both.weights, (std::vector<double>{1, 2, 3}));
  EXPECT_TRUE(std::ranges::any_of(both.warnings, [](const auto& w) { return w.code == "weights_replaced"; }));
  const CheckedInput zero = check_input(file, MeshFormat::kPly, {}, "[0, 0, 0]");
  EXPECT_TRUE(std::ranges::any_of(zero.warnings, [](const auto& w) { return w.code == "weights_all_zero"; }));
  EXPECT_TRUE(check_input("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", MeshFormat::kOff).weights.empty());
}

/// A cube with every vertex moved a little, as OBJ.
std::string uneven_cube() {
  Mesh mesh = test::cube(5);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const auto t = static_cast<double>(v);
    mesh.positions[v] += 0.04 * Vec3(std::sin(3 * t), std::sin(5 * t), std::sin(7 * t));
  }
  return test::obj_text(mesh);
}

JobOutput smoothed(const CheckedInput& input) {
  MrfOptions options;
  options.solver = Solver::kMetropolis;
  options.sweeps = 60;
  options.process = Process::kVertex;
  RunContext context;
  return run_job(input, {options}, context);
}

std::string weights_json(std::size_t vertices, double first_half, double second_half) {
  std::string json = "[";
  for (std::size_t v = 0; v < vertices; ++v) {
    json += fmt::format("{}{}", v == 0 ? "" : ",", 2 * v < vertices ? first_half : second_half);
  }
  return json + "]";
}

TEST(RunJob, AHeavierWeightKeepsVerticesNearWhereTheyWereMeasured) {
  const std::string obj = uneven_cube();
  const std::size_t vertices = check_input(obj, MeshFormat::kObj).mesh.positions.size();
  const CheckedInput input = check_input(obj, MeshFormat::kObj, {}, weights_json(vertices, 20, 1));
  const JobOutput output = smoothed(input);
  const auto displacement = [&](std::size_t from, std::size_t to) {
    double sum = 0;
    for (std::size_t v = from; v < to; ++v) {
      sum += (output.result.mesh.positions[v] - input.mesh.positions[v]).norm();
    }
    return sum / static_cast<double>(to - from);
  };
  EXPECT_LT(2 * displacement(0, vertices / 2), displacement(vertices / 2, vertices));
}

TEST(RunJob, WeightsOfOneAreNoWeights) {
  const std::string obj = uneven_cube();
  const CheckedInput plain = check_input(obj, MeshFormat::kObj);
  const CheckedInput ones = check_input(obj, MeshFormat::kObj, {}, weights_json(plain.mesh.positions.size(), 1, 1));
  EXPECT_EQ(smoothed(ones).result.mesh.positions, smoothed(plain).result.mesh.positions);
}

}  // namespace
}  // namespace crease
