#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/encode.h"
#include "tests/support/labelled_meshes.h"
#include "tests/unit/decode_samples.h"

namespace crease::test {
namespace {

Mesh glb_mesh(const GltfSample& sample) { return decode_mesh(sample.glb(), MeshFormat::kGlb).mesh; }

std::vector<Vec3> moved(std::vector<Vec3> positions, const Vec3& offset) {
  for (Vec3& position : positions) position += offset;
  return positions;
}

TEST(DecodeGltf, TheNodeOfASkinnedMeshDoesNotMoveIt) {
  GltfSample sample = gltf_sample(sample_mesh());
  sample.json["nodes"][0]["translation"] = {5, 6, 7};
  EXPECT_EQ(glb_mesh(sample).positions, moved(sample_mesh().positions, {5, 6, 7}));
  sample.json["nodes"][0]["skin"] = 0;
  sample.json["skins"] = {{{"joints", {0}}}};
  EXPECT_EQ(glb_mesh(sample).positions, sample_mesh().positions);
}

TEST(DecodeGltf, ChildrenOfASkinnedNodeAreMovedByIt) {
  GltfSample sample = gltf_sample(sample_mesh());
  sample.json["nodes"] = {{{"skin", 0}, {"mesh", 0}, {"translation", {1, 0, 0}}, {"children", {1}}}, {{"mesh", 0}}};
  sample.json["skins"] = {{{"joints", {0}}}};
  const std::vector<Vec3> positions = glb_mesh(sample).positions;
  EXPECT_EQ(positions.front(), sample_mesh().positions.front());
  EXPECT_EQ(positions.back(), Vec3(sample_mesh().positions.back() + Vec3(1, 0, 0)));
}

TEST(DecodeGltf, DefaultMorphWeightsAreApplied) {
  GltfSample sample = gltf_sample(sample_mesh());
  const std::size_t up = sample.add_positions(std::vector<Vec3>(5, Vec3(0, 0, 4)));
  const std::size_t right = sample.add_positions(std::vector<Vec3>(5, Vec3(2, 0, 0)));
  sample.primitive()["targets"] = {{{"POSITION", up}}, {{"POSITION", right}}};
  EXPECT_EQ(glb_mesh(sample).positions, sample_mesh().positions);
  sample.json["meshes"][0]["weights"] = {0.25, 0};
  EXPECT_EQ(glb_mesh(sample).positions, moved(sample_mesh().positions, {0, 0, 1}));
  sample.json["nodes"][0]["weights"] = {0, 1.5};  // goes before the mesh's
  EXPECT_EQ(glb_mesh(sample).positions, moved(sample_mesh().positions, {3, 0, 0}));
  sample.json["accessors"][right]["count"] = 4;
  EXPECT_EQ(refusal(sample.glb(), MeshFormat::kGlb)->code(), code::kMeshCountMismatch);
}

TEST(DecodeGltf, PrimitivesThatShareVerticesMayMorphThemDifferently) {
  GltfSample sample = gltf_sample(sample_mesh());
  const std::size_t up = sample.add_positions(std::vector<Vec3>(5, Vec3(0, 0, 4)));
  sample.json["meshes"][0]["primitives"].push_back(sample.primitive());
  sample.primitive(1)["targets"] = {{{"POSITION", up}}};
  sample.json["meshes"][0]["weights"] = {1};
  const Mesh mesh = glb_mesh(sample);
  EXPECT_EQ(mesh.positions.size(), 10U);
  EXPECT_EQ(mesh.positions[7], Vec3(sample_mesh().positions[2] + Vec3(0, 0, 4)));
}

TEST(DecodeGltf, QuantisedPositionsAreRead) {
  const std::vector<Triangle> faces{{0, 1, 2}};
  for (const bool normalized : {false, true}) {
    GltfSample sample = gltf_sample({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, faces});
    std::string bytes;
    for (const int value : {-32767, 0, 0, 0, 32767, 0, 0, 0, 16384}) {
      append(bytes, static_cast<std::int16_t>(value));
      if (bytes.size() % 8 == 6) append(bytes, std::int16_t{0});
    }
    const std::size_t accessor = sample.add(bytes, 5122, "VEC3", 3);
    sample.json["bufferViews"].back()["byteStride"] = 8;
    sample.json["accessors"][accessor]["normalized"] = normalized;
    sample.json["extensionsUsed"] = sample.json["extensionsRequired"] = {"KHR_mesh_quantization"};
    sample.primitive()["attributes"]["POSITION"] = accessor;
    const double unit = normalized ? 1.0 / 32767 : 1;
    const Mesh mesh = glb_mesh(sample);
    EXPECT_EQ(mesh.positions[0], Vec3(-32767 * unit, 0, 0));
    EXPECT_EQ(mesh.positions[1], Vec3(0, 32767 * unit, 0));
    EXPECT_EQ(mesh.positions[2], Vec3(0, 0, 16384 * unit));
  }
}

std::string percent_encoded(const std::string& bytes) {
  std::string text;
  for (const char c : bytes) text += fmt::format("%{:02X}", static_cast<unsigned char>(c));
  return text;
}

TEST(DecodeGltf, DataMayBePercentEncoded) {
  const GltfSample sample = gltf_sample(sample_mesh());
  Mesh moved_mesh = sample_mesh();
  moved_mesh.positions = moved(sample_mesh().positions, {0, 0, 1});
  for (const std::string& uri : {"data:application/gltf-buffer," + percent_encoded(sample.buffer),
                                 "data:;base64," + percent_encoded(base64(sample.buffer))}) {
    nlohmann::json json = sample.json;
    json["buffers"][0]["uri"] = uri;
    const std::string file = json.dump();
    EXPECT_EQ(decode_mesh(file, MeshFormat::kGltf).mesh.positions, sample_mesh().positions);
    const std::string original = encode_original(file, MeshFormat::kGltf, labelled(moved_mesh));
    EXPECT_EQ(decode_mesh(original, MeshFormat::kGltf).mesh.positions, moved_mesh.positions);
  }
  nlohmann::json json = sample.json;
  json["buffers"][0]["uri"] = "data:,%4";
  EXPECT_EQ(refusal(json.dump(), MeshFormat::kGltf)->code(), code::kMeshSyntax);
  json["buffers"][0]["uri"] = "buffer.bin";
  EXPECT_THAT(refusal(json.dump(), MeshFormat::kGltf)->detail(), testing::HasSubstr("buffer.bin"));
}

/// The sample in two copies: one turned by 90 degrees about z, one mirrored and twice as large; both behind the
/// transform of the node.
GltfSample instanced() {
  GltfSample sample = gltf_sample(sample_mesh());
  std::string turns;
  for (const int part : {0, 0, 23170, 23170, 0, 0, 0, 32767}) append(turns, static_cast<std::int16_t>(part));
  const std::size_t rotation = sample.add(turns, 5122, "VEC4", 2);
  sample.json["accessors"][rotation]["normalized"] = true;
  sample.json["nodes"][0]["translation"] = {0, 0, 100};
  sample.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", sample.add_positions({{10, 0, 0}, {0, 20, 0}})},
      {"ROTATION", rotation},
      {"SCALE", sample.add_positions({{1, 1, 1}, {2, 2, -2}})},
      {"_ID", sample.add_scalars(std::vector<float>{1, 2}, 5126)}};
  sample.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  sample.json["extensionsRequired"] = sample.json["extensionsUsed"];
  return sample;
}

TEST(DecodeGltf, AllCopiesOfAnInstancedMeshAreRead) {
  const Mesh once = sample_mesh(), mesh = glb_mesh(instanced());
  const std::size_t count = once.positions.size();
  ASSERT_EQ(mesh.positions.size(), 2 * count);
  for (std::size_t v = 0; v < count; ++v) {
    const Vec3& p = once.positions[v];
    EXPECT_NEAR((mesh.positions[v] - Vec3(10 - p.y(), p.x(), 100 + p.z())).norm(), 0, 1e-3);
    EXPECT_EQ(mesh.positions[count + v], Vec3(2 * p.x(), 20 + 2 * p.y(), 100 - 2 * p.z()));
  }
  EXPECT_EQ(mesh.triangles.size(), 2 * once.triangles.size());
  const auto& [a, b, c] = once.triangles[0];
  EXPECT_EQ(mesh.triangles[once.triangles.size()],
            (Triangle{static_cast<Index>(a + count), static_cast<Index>(c + count), static_cast<Index>(b + count)}));
  EXPECT_EQ(warning(decode_mesh(instanced().glb(), MeshFormat::kGlb), "attributes_dropped"), "");
}

TEST(DecodeGltf, FaultsOfInstancesAreRefused) {
  const auto refused = [](const auto& change) {
    GltfSample sample = instanced();
    change(sample.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"], sample);
    return refusal(sample.glb())->code();
  };
  EXPECT_EQ(refused([](nlohmann::json& copies, GltfSample&) { copies.erase("attributes"); }), code::kMeshSyntax);
  EXPECT_EQ(refused([](nlohmann::json& copies, GltfSample&) { copies["attributes"]["SCALE"] = 99; }),
            code::kMeshIndexOutOfRange);
  EXPECT_EQ(refused([](nlohmann::json& copies, GltfSample&) { copies["attributes"]["SCALE"] = 1; }),
            code::kMeshCountMismatch);
  EXPECT_EQ(refused([](nlohmann::json& copies, GltfSample&) {
              copies["attributes"]["SCALE"] = copies["attributes"]["ROTATION"];
            }),
            code::kMeshSyntax);
  EXPECT_EQ(refusal(instanced().glb(), MeshFormat::kGlb, {100, 1})->code(), code::kMeshTooLarge);
}

TEST(DecodeGltf, RequiredExtensionsThatMoveNoVertexAreAccepted) {
  GltfSample sample = gltf_sample(sample_mesh());
  for (const std::string name :
       {"MSFT_texture_dds", "KHR_materials_unlit", "EXT_texture_webp", "KHR_lights_punctual", "KHR_animation_pointer",
        "KHR_xmp_json_ld", "EXT_structural_metadata", "VRMC_vrm", "VRM", "KHR_environment_map", "EXT_mesh_manifold"}) {
    sample.json["extensionsRequired"] = {name};
    EXPECT_EQ(glb_mesh(sample).triangles, sample_mesh().triangles) << name;
  }
  for (const std::string name : {"MSFT_lod", "VENDOR_geometry"}) {
    sample.json["extensionsRequired"] = {name};
    EXPECT_EQ(refusal(sample.glb(), MeshFormat::kGlb)->code(), code::kMeshUnsupported) << name;
  }
}

}  // namespace
}  // namespace crease::test
