#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include "tests/unit/decode_samples.h"

namespace crease::test {
namespace {

using nlohmann::json;

DecodedMesh decoded(const GltfSample& sample) { return decode_mesh(sample.glb(), MeshFormat::kGlb); }

TEST(DecodeGltf, JsonAndBinaryFormsHoldTheSame) {
  const GltfSample sample = gltf_sample(sample_mesh());
  const Mesh from_json = decode_mesh(sample.gltf(), MeshFormat::kGltf).mesh;
  const Mesh from_binary = decoded(sample).mesh;
  EXPECT_EQ(from_json.positions, from_binary.positions);
  EXPECT_EQ(from_json.triangles, from_binary.triangles);
}

TEST(DecodeGltf, TransformsOfNodesAreApplied) {
  GltfSample sample = gltf_sample(sample_mesh());
  sample.json["nodes"] = json::parse(
      R"([{"children": [1], "translation": [1, 2, 3]}, {"mesh": 0, "rotation": [0, 0, 0.70710678118654752, 0.70710678118654752], "scale": [2, 2, 2]}])");
  const Mesh mesh = decoded(sample).mesh;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const Vec3 p = sample_mesh().positions[v];
    EXPECT_LT((mesh.positions[v] - Vec3(1 - 2 * p.y(), 2 + 2 * p.x(), 3 + 2 * p.z())).norm(), 1e-12);
  }
  EXPECT_EQ(mesh.triangles, sample_mesh().triangles);
}

TEST(DecodeGltf, AMirroringMatrixTurnsTheWinding) {
  GltfSample sample = gltf_sample(sample_mesh());
  sample.json["nodes"][0]["matrix"] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1};
  const Mesh mesh = decoded(sample).mesh;
  EXPECT_EQ(mesh.positions[1], Vec3(4, 0, 0));
  EXPECT_EQ(mesh.triangles[0], (Triangle{0, 1, 2}));
}

TEST(DecodeGltf, AMeshWithTwoInstancesIsReadTwice) {
  GltfSample sample = gltf_sample(connected_sample());
  sample.json["nodes"] = json::parse(R"([{"mesh": 0}, {"mesh": 0, "translation": [10, 0, 0]}])");
  sample.json["scenes"][0]["nodes"] = {0, 1};
  const Mesh mesh = decoded(sample).mesh;
  ASSERT_EQ(mesh.positions.size(), 8U);
  ASSERT_EQ(mesh.triangles.size(), 6U);
  EXPECT_EQ(mesh.positions[5], Vec3(11, 0, 0));
  EXPECT_EQ(mesh.triangles[3], (Triangle{4, 6, 5}));
}

TEST(DecodeGltf, AllMeshesAreReadWhenThereAreNoScenes) {
  GltfSample sample = gltf_sample(sample_mesh());
  sample.json.erase("scenes");
  sample.json.erase("scene");
  sample.json.erase("nodes");
  EXPECT_EQ(decoded(sample).mesh.positions, sample_mesh().positions);
}

TEST(DecodeGltf, StripsAndFansBecomeTriangles) {
  const std::vector<Vec3> square{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 2, 0}};
  GltfSample sample = gltf_sample({square, {}});
  sample.primitive().erase("indices");
  sample.primitive()["mode"] = 5;
  EXPECT_EQ(decoded(sample).mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}, {2, 3, 4}}));
  sample.primitive()["mode"] = 6;
  EXPECT_EQ(decoded(sample).mesh.triangles, (std::vector<Triangle>{{1, 2, 0}, {2, 3, 0}, {3, 4, 0}}));
}

TEST(DecodeGltf, IndicesOfAllWidthsAreRead) {
  for (const int component : {5121, 5123, 5125}) {
    GltfSample sample = gltf_sample(sample_mesh());
    const std::vector<std::uint32_t> corners{0, 2, 1, 0, 1, 3, 1, 2, 3};
    const std::size_t accessor =
        component == 5121   ? sample.add_scalars(std::vector<std::uint8_t>(corners.begin(), corners.end()), component)
        : component == 5123 ? sample.add_scalars(std::vector<std::uint16_t>(corners.begin(), corners.end()), component)
                            : sample.add_scalars(corners, component);
    sample.primitive()["indices"] = accessor;
    EXPECT_EQ(decoded(sample).mesh.triangles, sample_mesh().triangles) << component;
  }
}

TEST(DecodeGltf, StridedPositionsAreRead) {
  GltfSample sample = gltf_sample(sample_mesh());
  std::string data;
  for (const Vec3& p : sample_mesh().positions) {
    append(data, std::uint32_t{0xffffffff});
    append_floats(data, p);
  }
  const std::size_t accessor = sample.add(data, 5126, "VEC3", sample_mesh().positions.size());
  sample.json["bufferViews"].back()["byteStride"] = 16;
  sample.json["accessors"][accessor]["byteOffset"] = 4;
  sample.primitive()["attributes"]["POSITION"] = accessor;
  EXPECT_EQ(decoded(sample).mesh.positions, sample_mesh().positions);
}

TEST(DecodeGltf, SparseAccessorsReplaceElementsOfABaseOrOfZeros) {
  for (const bool with_base : {true, false}) {
    GltfSample sample = gltf_sample(connected_sample());
    std::string values;
    append_floats(values, {7, 8, 9});
    append_floats(values, {1, 1, 1});
    const std::size_t at = sample.add_scalars(std::vector<std::uint16_t>{1, 3}, 5123);
    const std::size_t with = sample.add(values, 5126, "VEC3", 2);
    json& positions = sample.json["accessors"][0];
    positions["sparse"] = {
        {"count", 2}, {"indices", {{"bufferView", at}, {"componentType", 5123}}}, {"values", {{"bufferView", with}}}};
    if (!with_base) positions.erase("bufferView");
    const Mesh mesh = decoded(sample).mesh;
    EXPECT_EQ(mesh.positions[mesh.triangles[0][2]], Vec3(7, 8, 9));
    EXPECT_EQ(mesh.positions[mesh.triangles[1][2]], Vec3(1, 1, 1));
    EXPECT_EQ(mesh.positions[mesh.triangles[0][1]], with_base ? connected_sample().positions[2] : Vec3(0, 0, 0));
  }
}

TEST(DecodeGltf, CopiesWithASourceAreMerged) {
  Mesh split = sample_mesh();
  const std::size_t vertices = split.positions.size();
  split.positions.push_back(split.positions[1]);
  split.positions.push_back(split.positions[2]);
  split.positions.push_back(split.positions[1]);
  split.triangles[1][1] = 5;
  split.triangles[2] = {7, 6, 3};
  for (const bool as_float : {true, false}) {
    GltfSample sample = gltf_sample(split);
    const std::vector<std::uint32_t> sources{0, 1, 2, 3, 4, 1, 2, 1};
    sample.primitive()["attributes"]["_SOURCE"] =
        as_float ? sample.add_scalars(std::vector<float>(sources.begin(), sources.end()), 5126)
                 : sample.add_scalars(sources, 5125);
    const DecodedMesh result = decoded(sample);
    EXPECT_EQ(result.mesh.positions.size(), vertices);
    EXPECT_EQ(result.mesh.positions, sample_mesh().positions);
    EXPECT_EQ(result.mesh.triangles, sample_mesh().triangles);
    EXPECT_TRUE(result.warnings.empty());
  }
}

TEST(DecodeGltf, CoincidentVerticesWithDifferentSourcesStayApart) {
  Mesh mesh = sample_mesh();
  mesh.positions[4] = mesh.positions[0];
  GltfSample sample = gltf_sample(mesh);
  sample.primitive()["attributes"]["_SOURCE"] = sample.add_scalars(std::vector<float>{0, 1, 2, 3, 4}, 5126);
  EXPECT_EQ(decoded(sample).mesh.positions, mesh.positions);
}

TEST(DecodeGltf, AForeignSourceAttributeIsIgnoredWithAWarning) {
  for (const std::vector<float>& sources :
       {std::vector<float>{0, 0, 0, 0, 0}, {0, 1, 2, 3, 9}, {0, 1, 2, 3, 0.5F}, {0, 1, 2, 3, -1}, {0, 1}}) {
    GltfSample sample = gltf_sample(sample_mesh());
    sample.primitive()["attributes"]["_SOURCE"] = sample.add_scalars(sources, 5126);
    const DecodedMesh result = decoded(sample);
    EXPECT_EQ(result.mesh.positions, sample_mesh().positions);
    EXPECT_NE(warning(result, "source_ignored"), "");
  }
}

TEST(DecodeGltf, VerticesSplitAtSeamsAreWeldedWithAWarning) {
  Mesh split;
  for (const Triangle& t : sample_mesh().triangles) {
    const auto first = static_cast<Index>(split.positions.size());
    for (const Index corner : t) split.positions.push_back(sample_mesh().positions[corner]);
    split.triangles.push_back({first, first + 1, first + 2});
  }
  const DecodedMesh result = decoded(gltf_sample(split));
  EXPECT_EQ(result.mesh.positions.size(), 4U);
  EXPECT_EQ(result.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {2, 1, 3}}));
  EXPECT_EQ(warning(result, "vertices_welded").substr(0, 9), "welded 5 ");
}

TEST(DecodeGltf, PrimitivesThatShareTheirPositionsShareVertices) {
  GltfSample sample = gltf_sample(sample_mesh());
  const json primitive = sample.primitive();
  sample.json["meshes"][0]["primitives"].push_back(primitive);
  const DecodedMesh result = decoded(sample);
  EXPECT_EQ(result.mesh.positions.size(), 5U);
  EXPECT_EQ(result.mesh.triangles.size(), 6U);
  EXPECT_TRUE(result.warnings.empty());
}

TEST(DecodeGltf, LinesAndPointsAreSkippedWithAWarning) {
  GltfSample sample = gltf_sample(sample_mesh());
  for (const int mode : {0, 1, 2, 3}) {
    json primitive = sample.primitive();
    primitive["mode"] = mode;
    sample.json["meshes"][0]["primitives"].push_back(primitive);
  }
  const DecodedMesh result = decoded(sample);
  EXPECT_EQ(result.mesh.triangles, sample_mesh().triangles);
  EXPECT_EQ(warning(result, "primitives_skipped").substr(0, 10), "skipped 4 ");
}

TEST(DecodeGltf, TrailingBytesAndUnknownChunksAreIgnored) {
  std::string bytes = gltf_sample(sample_mesh()).glb();
  EXPECT_NE(warning(decode_mesh(bytes + "tail", MeshFormat::kGlb), "trailing_bytes"), "");
  append(bytes, std::uint32_t{4});
  bytes += "XTRAdata";
  const auto length = static_cast<std::uint32_t>(bytes.size());
  std::memcpy(bytes.data() + 8, &length, 4);
  EXPECT_TRUE(decode_mesh(bytes, MeshFormat::kGlb).warnings.empty());
}

/// The sample with its buffer views compressed by meshoptimizer, as gltfpack writes it: buffer 1 stands for the data
/// that is there in compressed form only.
GltfSample compressed_sample() {
  GltfSample sample = gltf_sample(sample_mesh());
  std::string compressed;
  for (const std::size_t view : {0U, 1U}) {
    json& object = sample.json["bufferViews"][view];
    const std::string data = sample.buffer.substr(object["byteOffset"], object["byteLength"]);
    const bool are_positions = view == 0;
    const std::size_t stride = are_positions ? 12 : 4, count = data.size() / stride;
    std::string packed(data.size() + 1000, '\0');
    auto* const bytes = reinterpret_cast<unsigned char*>(packed.data());
    std::vector<unsigned int> corners(count);
    if (!are_positions) std::memcpy(corners.data(), data.data(), data.size());
    packed.resize(are_positions ? meshopt_encodeVertexBuffer(bytes, packed.size(), data.data(), count, stride)
                                : meshopt_encodeIndexSequence(bytes, packed.size(), corners.data(), count));
    object["buffer"] = 1;
    object["extensions"]["EXT_meshopt_compression"] = {{"buffer", 0},
                                                       {"byteOffset", compressed.size()},
                                                       {"byteLength", packed.size()},
                                                       {"byteStride", stride},
                                                       {"mode", are_positions ? "ATTRIBUTES" : "INDICES"},
                                                       {"count", count}};
    compressed += packed;
  }
  sample.json["buffers"] = {
      {{"byteLength", compressed.size()}},
      {{"byteLength", sample.buffer.size()}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}}};
  sample.buffer = compressed;
  sample.buffer.resize((sample.buffer.size() + 3) / 4 * 4, '\0');
  sample.json["extensionsRequired"] = {"EXT_meshopt_compression"};
  return sample;
}

TEST(DecodeGltf, BuffersThatMeshoptimizerHasCompressedAreRead) {
  const DecodedMesh found = decoded(compressed_sample());
  EXPECT_EQ(found.mesh.positions, sample_mesh().positions);
  EXPECT_EQ(found.mesh.triangles, sample_mesh().triangles);
}

TEST(DecodeGltf, CompressedBuffersThatDoNotHoldTheirCountAreRefused) {
  for (const auto& [member, value] : {std::pair<const char*, json>{"count", 1'000'000'000'000U},
                                      {"count", 4},
                                      {"byteStride", 8},
                                      {"byteStride", 0},
                                      {"byteLength", 3},
                                      {"byteLength", 1'000'000},
                                      {"mode", "TRIANGLES"},
                                      {"mode", 7},
                                      {"filter", "OCTAHEDRAL"},
                                      {"filter", "UNKNOWN"},
                                      {"buffer", 9}}) {
    GltfSample sample = compressed_sample();
    sample.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"][member] = value;
    EXPECT_TRUE(refusal(sample.glb(), MeshFormat::kGlb).has_value()) << member << value;
  }
  GltfSample sample = compressed_sample();
  sample.json["bufferViews"][0]["byteLength"] = 60'000'000'000U;
  sample.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["count"] = 5'000'000'000U;
  EXPECT_EQ(refusal(sample.glb(), MeshFormat::kGlb)->code(), code::kMeshCountMismatch);
}

TEST(DecodeGltf, ExtensionsThatOnlyConcernAppearanceMayBeRequired) {
  GltfSample sample = gltf_sample(sample_mesh());
  sample.json["extensionsRequired"] = {"KHR_texture_transform"};
  EXPECT_EQ(decoded(sample).mesh.triangles.size(), 3U);
}

struct Fault {
  const char* name;
  void (*bend)(GltfSample&);
  ErrorCode code;
  const char* place;
};

void PrintTo(const Fault& fault, std::ostream* out) { *out << fault.name; }

class DecodeGltfFault : public testing::TestWithParam<Fault> {};

TEST_P(DecodeGltfFault, IsRefusedWithCodeAndPlace) {
  GltfSample sample = gltf_sample(sample_mesh());
  GetParam().bend(sample);
  const std::optional<Error> error = refusal(sample.glb(), MeshFormat::kGlb);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->code(), GetParam().code) << error->detail();
  if (GetParam().place != nullptr) {
    EXPECT_EQ(error->place(), GetParam().place) << error->detail();
  }
}

const Fault kFaults[] = {
    {"no_asset", [](GltfSample& s) { s.json.erase("asset"); }, code::kMeshSyntax, "asset"},
    {"version_1", [](GltfSample& s) { s.json["asset"]["version"] = "1.0"; }, code::kMeshUnsupported, "asset"},
    {"required_levels", [](GltfSample& s) { s.json["extensionsRequired"] = {"MSFT_lod"}; }, code::kMeshUnsupported,
     "extensionsRequired"},
    {"external_buffer", [](GltfSample& s) { s.json["buffers"][0]["uri"] = "../../etc/passwd"; }, code::kMeshUnsupported,
     "buffer 0"},
    {"remote_buffer", [](GltfSample& s) { s.json["buffers"][0]["uri"] = "http://localhost/a.bin"; },
     code::kMeshUnsupported, "buffer 0"},
    {"bad_base64", [](GltfSample& s) { s.json["buffers"][0]["uri"] = "data:;base64,AA!A"; }, code::kMeshSyntax,
     "buffer 0"},
    {"buffer_too_long", [](GltfSample& s) { s.json["buffers"][0]["byteLength"] = 1'000'000; }, code::kMeshCountMismatch,
     "buffer 0"},
    {"second_buffer_without_data",
     [](GltfSample& s) {
       s.json["buffers"].push_back({{"byteLength", 4}});
     },
     code::kMeshUnsupported, "buffer 1"},
    {"view_too_long", [](GltfSample& s) { s.json["bufferViews"][0]["byteLength"] = 1'000'000; },
     code::kMeshCountMismatch, "bufferView 0"},
    {"view_offset_overflows", [](GltfSample& s) { s.json["bufferViews"][0]["byteOffset"] = UINT64_MAX; },
     code::kMeshCountMismatch, "bufferView 0"},
    {"view_of_no_buffer", [](GltfSample& s) { s.json["bufferViews"][0]["buffer"] = 7; }, code::kMeshIndexOutOfRange,
     "bufferView 0"},
    {"count_too_large", [](GltfSample& s) { s.json["accessors"][0]["count"] = 4'000'000'000U; },
     code::kMeshCountMismatch, "accessor 0"},
    {"count_overflows", [](GltfSample& s) { s.json["accessors"][0]["count"] = UINT64_MAX; }, code::kMeshCountMismatch,
     "accessor 0"},
    {"count_negative", [](GltfSample& s) { s.json["accessors"][0]["count"] = -1; }, code::kMeshSyntax, "accessor 0"},
    {"zeros_without_end",
     [](GltfSample& s) {
       s.json["accessors"][0].erase("bufferView");
       s.json["accessors"][0]["count"] = 10'000'000;
     },
     code::kMeshCountMismatch, "accessor 0"},
    {"offset_behind_view", [](GltfSample& s) { s.json["accessors"][0]["byteOffset"] = 4; }, code::kMeshCountMismatch,
     "accessor 0"},
    {"stride_too_small", [](GltfSample& s) { s.json["bufferViews"][0]["byteStride"] = 4; }, code::kMeshSyntax,
     "bufferView 0"},
    {"stride_zero", [](GltfSample& s) { s.json["bufferViews"][0]["byteStride"] = 0; }, code::kMeshSyntax,
     "bufferView 0"},
    {"no_such_accessor", [](GltfSample& s) { s.primitive()["indices"] = 99; }, code::kMeshIndexOutOfRange, "mesh 0"},
    {"no_such_mesh", [](GltfSample& s) { s.json["nodes"][0]["mesh"] = 5; }, code::kMeshIndexOutOfRange, "mesh 5"},
    {"no_such_node", [](GltfSample& s) { s.json["scenes"][0]["nodes"] = {3}; }, code::kMeshIndexOutOfRange, "node 3"},
    {"no_such_scene", [](GltfSample& s) { s.json["scene"] = 3; }, code::kMeshIndexOutOfRange, "scene"},
    {"no_positions", [](GltfSample& s) { s.primitive()["attributes"].erase("POSITION"); }, code::kMeshSyntax, "mesh 0"},
    {"integer_positions", [](GltfSample& s) { s.json["accessors"][0]["componentType"] = 5125; }, code::kMeshUnsupported,
     "accessor 0"},
    {"float_indices", [](GltfSample& s) { s.json["accessors"][1]["componentType"] = 5126; }, code::kMeshSyntax,
     "accessor 1"},
    {"unknown_mode", [](GltfSample& s) { s.primitive()["mode"] = 7; }, code::kMeshSyntax, "mesh 0"},
    {"two_corners_left", [](GltfSample& s) { s.json["accessors"][1]["count"] = 8; }, code::kMeshCountMismatch,
     "mesh 0"},
    {"only_lines", [](GltfSample& s) { s.primitive()["mode"] = 1; }, code::kMeshNoFaces, nullptr},
    {"index_out_of_range", [](GltfSample& s) { s.buffer[60 + 24] = 5; }, code::kMeshIndexOutOfRange, "face 2"},
    {"not_a_number", [](GltfSample& s) { s.buffer.replace(12, 4, "\xff\xff\xff\x7f"); }, code::kMeshNotFinite,
     "accessor 0, element 1"},
    {"transform_not_finite",
     [](GltfSample& s) {
       s.json["nodes"][0]["scale"] = {1e300, 1e300, 1e300};
       s.json["nodes"].push_back({{"children", {0}}, {"scale", {1e300, 1, 1}}});
       s.json["scenes"][0]["nodes"] = {1};
     },
     code::kMeshNotFinite, "accessor 0, element 0"},
    {"node_is_its_own_child", [](GltfSample& s) { s.json["nodes"][0]["children"] = {0}; }, code::kMeshSyntax, "node 0"},
    {"matrix_of_15", [](GltfSample& s) { s.json["nodes"][0]["matrix"] = std::vector<int>(15, 1); }, code::kMeshSyntax,
     "node 0"},
    {"meshes_no_array", [](GltfSample& s) { s.json["meshes"] = 3; }, code::kMeshSyntax, "meshes"},
};

INSTANTIATE_TEST_SUITE_P(Table, DecodeGltfFault, testing::ValuesIn(kFaults),
                         [](const auto& parameter) { return std::string(parameter.param.name); });

TEST(DecodeGltf, DeepNestingIsRefusedWithoutRecursion) {
  const std::string deep(1'000'000, '[');
  const auto error = refusal(R"({"asset": {"version": "2.0"}, "extras": )" + deep, MeshFormat::kGltf);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->code(), code::kMeshTooLarge);
}

TEST(DecodeGltf, JsonWithTooManyValuesIsRefused) {
  std::string values;
  for (int i = 0; i < 600'000; ++i) values += "0,";
  const auto error = refusal(R"({"asset": {"version": "2.0"}, "extras": [)" + values + "0]}", MeshFormat::kGltf);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->code(), code::kMeshTooLarge);
}

TEST(DecodeGltf, JsonErrorsGiveTheirByteOffset) {
  const auto broken = refusal(R"({"asset": oops})", MeshFormat::kGltf);
  ASSERT_TRUE(broken.has_value());
  EXPECT_EQ(broken->code(), code::kMeshSyntax);
  EXPECT_EQ(broken->place(), "byte 10");
  const auto cut = refusal(R"({"asset": {"version")", MeshFormat::kGltf);
  ASSERT_TRUE(cut.has_value());
  EXPECT_EQ(cut->code(), code::kMeshTruncated);
}

TEST(DecodeGltf, LimitsApplyToTheInstancesInTotal) {
  GltfSample sample = gltf_sample(sample_mesh());
  sample.json["nodes"] = json::array();
  sample.json["scenes"][0]["nodes"] = json::array();
  for (int i = 0; i < 100; ++i) {
    sample.json["nodes"].push_back({{"mesh", 0}});
    sample.json["scenes"][0]["nodes"].push_back(i);
  }
  EXPECT_EQ(refusal(sample.glb(), MeshFormat::kGlb, {400, 1000})->code(), code::kMeshTooLarge);
  EXPECT_EQ(refusal(sample.glb(), MeshFormat::kGlb, {1000, 200})->code(), code::kMeshTooLarge);
}

}  // namespace
}  // namespace crease::test
