#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/error.h"
#include "core/io/encode.h"
#include "core/measure/noise.h"
#include "tests/support/labelled_meshes.h"
#include "tests/support/meshes.h"
#include "tests/unit/decode_samples.h"

namespace crease::test {
namespace {

using nlohmann::json;

json json_of(const std::string& glb) {
  std::uint32_t size = 0;
  std::memcpy(&size, glb.data() + 12, 4);
  return json::parse(glb.substr(20, size));
}

/// The floats of an accessor whose view is tight.
std::vector<float> floats_of(const std::string& glb, std::size_t accessor) {
  std::uint32_t json_size = 0;
  std::memcpy(&json_size, glb.data() + 12, 4);
  const json file = json_of(glb);
  const json& entry = file["accessors"][accessor];
  const json& view = file["bufferViews"][entry["bufferView"].get<std::size_t>()];
  std::vector<float> values(entry["count"].get<std::size_t>() * (entry["type"] == "VEC3" ? 3 : 1));
  std::memcpy(values.data(), glb.data() + 28 + json_size + view.value("byteOffset", std::size_t{0}), 4 * values.size());
  return values;
}

/// Moves the vertices of the file, writes the original, and expects to read the moved positions within `tolerance`.
std::string expect_round_trip(const GltfSample& sample, double tolerance) {
  const DecodedMesh before = decode_mesh(sample.glb(), MeshFormat::kGlb);
  const Mesh after = add_noise(before.mesh, 0.1, 5, NoiseKind::kGaussian);
  const std::string file = encode_original(sample.glb(), MeshFormat::kGlb, labelled(after));
  const DecodedMesh read = decode_mesh(file, MeshFormat::kGlb);
  EXPECT_EQ(read.mesh.triangles, after.triangles);
  EXPECT_EQ(read.mesh.positions.size(), after.positions.size());
  for (std::size_t v = 0; v < std::min(read.mesh.positions.size(), after.positions.size()); ++v) {
    EXPECT_LT((read.mesh.positions[v] - after.positions[v]).norm(), tolerance) << v;
  }
  return file;
}

constexpr double kSingle = 2e-6;

/// What is not about positions.
json without_data(json file) {
  for (const char* member : {"accessors", "bufferViews", "buffers"}) file.erase(member);
  return file;
}

TEST(EncodeOriginalGltf, KeepsEverythingThatIsNotAPosition) {
  GltfSample sample = gltf_sample(connected_sample());
  sample.primitive()["attributes"]["TEXCOORD_0"] = sample.add(std::string(32, 'x'), 5126, "VEC2", 4);
  sample.primitive()["attributes"]["_CUSTOM"] = sample.add_scalars(std::vector<float>{1, 2, 3, 4}, 5126);
  sample.primitive()["material"] = 0;
  sample.json["materials"] = json::parse(R"([{"name": "steel", "pbrMetallicRoughness": {"metallicFactor": 0.25}}])");
  sample.json["nodes"] = json::parse(R"([
      {"children": [1], "name": "root", "translation": [10, 0, 0], "extras": {"z": 1, "a": [1e300, null, "ü"]}},
      {"mesh": 0, "rotation": [0, 0, 0.6, 0.8], "scale": [2, 3, -0.5]}, {"camera": 0}])");
  sample.json["cameras"] = json::parse(R"([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.01}}])");
  sample.json["extensions"] = json::parse(R"({"VENDOR_unknown": {"list": [1, 2.5]}})");
  const std::string file = expect_round_trip(sample, 20 * kSingle);
  EXPECT_EQ(without_data(json_of(file)), without_data(sample.json));
  EXPECT_EQ(json_of(file)["bufferViews"], sample.json["bufferViews"]);
  EXPECT_EQ(json_of(file)["buffers"], sample.json["buffers"]);
  EXPECT_EQ(floats_of(file, 2).size(), 4U);
  for (const std::size_t accessor : {1U, 3U}) EXPECT_EQ(floats_of(file, accessor), floats_of(sample.glb(), accessor));
}

TEST(EncodeOriginalGltf, PositionsHaveTheirExtent) {
  const std::string file = expect_round_trip(gltf_sample(connected_sample()), kSingle);
  const json accessor = json_of(file)["accessors"][0];
  const std::vector<float> values = floats_of(file, 0);
  for (std::size_t k = 0; k < 3; ++k) {
    float least = values[k], most = values[k];
    for (std::size_t i = k; i < values.size(); i += 3) {
      least = std::min(least, values[i]);
      most = std::max(most, values[i]);
    }
    EXPECT_EQ(accessor["min"][k].get<float>(), least);
    EXPECT_EQ(accessor["max"][k].get<float>(), most);
  }
}

TEST(EncodeOriginalGltf, EachInstanceHasItsOwnResult) {
  GltfSample sample = gltf_sample(connected_sample());
  sample.json["nodes"] = json::parse(R"([{"mesh": 0, "name": "a"}, {"mesh": 0, "translation": [10, 0, 0]}])");
  sample.json["scenes"][0]["nodes"] = {0, 1};
  const json file = json_of(expect_round_trip(sample, 20 * kSingle));
  EXPECT_EQ(file["meshes"].size(), 2U);
  EXPECT_EQ(file["nodes"][0]["mesh"], 0);
  EXPECT_EQ(file["nodes"][1]["mesh"], 1);
}

TEST(EncodeOriginalGltf, AMeshThatMovesAlikeEverywhereStaysOne) {
  GltfSample sample = gltf_sample(connected_sample());
  sample.json["nodes"] = json::parse(R"([{"mesh": 0}, {"mesh": 0, "translation": [16, 0, 0]}])");
  sample.json["scenes"][0]["nodes"] = {0, 1};
  Mesh mesh = decode_mesh(sample.glb(), MeshFormat::kGlb).mesh;
  for (Vec3& position : mesh.positions) position.z() += 0.5;
  const std::string file = encode_original(sample.glb(), MeshFormat::kGlb, labelled(mesh));
  EXPECT_EQ(without_data(json_of(file)), without_data(sample.json));
  EXPECT_EQ(decode_mesh(file, MeshFormat::kGlb).mesh.positions, mesh.positions);
}

GltfSample instanced_sample() {
  GltfSample sample = gltf_sample(connected_sample());
  sample.json["nodes"][0]["name"] = "rows";
  sample.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] =
      sample.add_positions({{0, 0, 0}, {16, 0, 0}, {32, 0, 0}});
  sample.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  return sample;
}

TEST(EncodeOriginalGltf, CopiesThatMoveAlikeStayInstances) {
  const GltfSample sample = instanced_sample();
  Mesh mesh = decode_mesh(sample.glb(), MeshFormat::kGlb).mesh;
  for (Vec3& position : mesh.positions) position.z() += 0.5;
  const std::string file = encode_original(sample.glb(), MeshFormat::kGlb, labelled(mesh));
  EXPECT_EQ(without_data(json_of(file)), without_data(sample.json));
  EXPECT_EQ(decode_mesh(file, MeshFormat::kGlb).mesh.positions, mesh.positions);
}

TEST(EncodeOriginalGltf, CopiesThatDifferBecomeNodes) {
  const json file = json_of(expect_round_trip(instanced_sample(), 20 * kSingle));
  EXPECT_EQ(file["meshes"].size(), 3U);
  EXPECT_EQ(file["nodes"].size(), 4U);
  EXPECT_EQ(file["nodes"][0], json::parse(R"({"name": "rows", "children": [1, 2, 3]})"));
  EXPECT_EQ(file["nodes"][2]["translation"], json::parse("[16, 0, 0]"));
  EXPECT_FALSE(file.contains("extensionsUsed"));
}

TEST(EncodeOriginalGltf, ABufferOfSeveralMeshesIsWrittenOnce) {
  GltfSample sample = gltf_sample(connected_sample());
  sample.json["meshes"].push_back(sample.json["meshes"][0]);
  sample.json["nodes"] = json::parse(R"([{"mesh": 0}, {"mesh": 1}])");
  sample.json["scenes"][0]["nodes"] = {0, 1};
  const json file = json_of(expect_round_trip(sample, kSingle));
  EXPECT_EQ(file["meshes"], sample.json["meshes"]);
}

TEST(EncodeOriginalGltf, MorphTargetsAndSkinsStay) {
  GltfSample sample = gltf_sample(connected_sample());
  const std::size_t target = sample.add_positions({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}});
  sample.primitive()["targets"] = json::array({{{"POSITION", target}}});
  sample.json["meshes"][0]["weights"] = {0.5};
  sample.json["nodes"][0] = {{"mesh", 0}, {"skin", 0}, {"translation", {5, 5, 5}}};
  sample.json["skins"] = json::parse(R"([{"joints": [0]}])");
  const std::string file = expect_round_trip(sample, kSingle);
  EXPECT_EQ(without_data(json_of(file)), without_data(sample.json));
  EXPECT_EQ(floats_of(file, target), floats_of(sample.glb(), target));
}

TEST(EncodeOriginalGltf, SparseAndQuantisedPositionsBecomeFloats) {
  GltfSample sparse = gltf_sample(connected_sample());
  sparse.add(std::string("\1\0\0\0", 4), 5121, "SCALAR", 1);
  std::string value;
  append_floats(value, {2, 0, 0});
  sparse.add(value, 5126, "VEC3", 1);
  sparse.json["accessors"][0]["sparse"] = {
      {"count", 1}, {"indices", {{"bufferView", 2}, {"componentType", 5121}}}, {"values", {{"bufferView", 3}}}};
  expect_round_trip(sparse, kSingle);

  GltfSample quantised = gltf_sample(connected_sample());
  std::string data;
  for (const int coordinate : {0, 0, 0, 100, 0, 0, 0, 100, 0, 0, 0, 100})
    append(data, static_cast<std::int16_t>(coordinate));
  quantised.primitive()["attributes"]["POSITION"] = quantised.add(data, 5122, "VEC3", 4);
  quantised.json["nodes"][0]["scale"] = {0.01, 0.01, 0.01};
  quantised.json["extensionsRequired"] = {"KHR_mesh_quantization"};
  expect_round_trip(quantised, kSingle);
}

TEST(EncodeOriginalGltf, NormalsTurnWithTheNode) {
  const Mesh mesh = cube(1);
  GltfSample sample = gltf_sample(mesh);
  sample.primitive()["attributes"]["NORMAL"] = sample.add_positions(std::vector<Vec3>(8, Vec3(0.25, 0.5, 1)));
  sample.json["nodes"][0]["scale"] = {1, 2, 4};
  sample.json["nodes"][0]["rotation"] = {0, 0, 0.6, 0.8};
  LabelledMesh result = labelled(decode_mesh(sample.glb(), MeshFormat::kGlb).mesh);
  std::ranges::fill(result.labels, 0.0);
  const std::string file = encode_original(sample.glb(), MeshFormat::kGlb, result);
  const std::vector<float> positions = floats_of(file, 0), normals = floats_of(file, 2);
  const Eigen::Vector3f middle(positions[0] / 2 + positions[21] / 2, positions[1] / 2 + positions[22] / 2,
                               positions[2] / 2 + positions[23] / 2);
  for (std::size_t v = 0; v < 8; ++v) {
    const Eigen::Vector3f normal(normals[3 * v], normals[3 * v + 1], normals[3 * v + 2]);
    EXPECT_NEAR(normal.norm(), 1, 1e-6);
    EXPECT_GT(normal.dot(Eigen::Vector3f(positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]) - middle), 0);
  }
}

TEST(EncodeOriginalGltf, OtherChunksAndTrailingBytesStay) {
  std::string glb = gltf_sample(connected_sample()).glb();
  append(glb, std::uint32_t{4});
  glb += "ABCDdata";
  const auto length = static_cast<std::uint32_t>(glb.size());
  std::memcpy(glb.data() + 8, &length, 4);
  glb += "behind";
  const LabelledMesh result = labelled(decode_mesh(glb, MeshFormat::kGlb).mesh);
  const std::string file = encode_original(glb, MeshFormat::kGlb, result);
  EXPECT_TRUE(file.ends_with(std::string("\4\0\0\0ABCDdatabehind", 18)));
  EXPECT_EQ(decode_mesh(file, MeshFormat::kGlb).mesh.positions, result.mesh.positions);
}

TEST(EncodeOriginalGltf, AFlatNodeIsRefused) {
  GltfSample sample = gltf_sample(connected_sample());
  sample.json["nodes"][0]["scale"] = {1, 1, 0};
  const LabelledMesh result = labelled(decode_mesh(sample.glb(), MeshFormat::kGlb).mesh);
  EXPECT_THROW(encode_original(sample.glb(), MeshFormat::kGlb, result), Error);
}

/// A file for rendering comes back as one: copies of a vertex stay together.
TEST(EncodeOriginalGltf, OurOwnFilesComeBack) {
  const std::string glb = encode_mesh(labelled(cube(3)), MeshFormat::kGlb);
  const Mesh after =
      in_single_precision(add_noise(decode_mesh(glb, MeshFormat::kGlb).mesh, 0.1, 5, NoiseKind::kGaussian));
  const std::string file = encode_original(glb, MeshFormat::kGlb, labelled(after));
  EXPECT_EQ(decode_mesh(file, MeshFormat::kGlb).mesh.positions, after.positions);
  EXPECT_EQ(without_data(json_of(file)), without_data(json_of(glb)));
}

/// A sphere of separate triangles has the normals of a sphere.
TEST(CornerNormals, ASeamDoesNotShow) {
  const LabelledMesh whole = labelled(icosphere(2));
  LabelledMesh torn = whole;
  torn.mesh.positions.clear();
  for (Triangle& triangle : torn.mesh.triangles) {
    for (Index& corner : triangle) {
      torn.mesh.positions.push_back(whole.mesh.positions[corner]);
      corner = static_cast<Index>(torn.mesh.positions.size() - 1);
    }
  }
  torn.edges.clear();
  torn.labels.clear();
  for (std::size_t face = 0; face < torn.mesh.triangles.size(); ++face) {
    const auto& [a, b, c] = torn.mesh.triangles[face];
    torn.edges.insert(torn.edges.end(), {{a, b}, {b, c}, {a, c}});
  }
  torn.labels.assign(torn.edges.size(), 0.1);
  const std::string glb = encode_mesh(torn, MeshFormat::kGlb);
  const json attributes = json_of(glb)["meshes"][0]["primitives"][0]["attributes"];
  const std::vector<float> positions = floats_of(glb, attributes["POSITION"]);
  const std::vector<float> normals = floats_of(glb, attributes["NORMAL"]);
  ASSERT_EQ(positions.size(), normals.size());
  for (std::size_t i = 0; i < normals.size(); i += 3) {  // of a sphere around 0
    const Eigen::Vector3f position(positions[i], positions[i + 1], positions[i + 2]);
    EXPECT_GT(position.normalized().dot(Eigen::Vector3f(normals[i], normals[i + 1], normals[i + 2])), 0.999);
  }
}

}  // namespace
}  // namespace crease::test
