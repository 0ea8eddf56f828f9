#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/io/encode.h"
#include "core/measure/noise.h"
#include "tests/support/labelled_meshes.h"
#include "tests/support/meshes.h"
#include "tests/unit/decode_samples.h"

namespace crease {
namespace {

constexpr MeshStyle kCompressed{.compressed = true}, kQuantized{.quantized = true};
constexpr MeshStyle kBoth{.compressed = true, .quantized = true};

LabelledMesh noisy_result(const Mesh& mesh) { return test::labelled(add_noise(mesh, 0.1, 4, NoiseKind::kGaussian)); }

DecodedMesh read_back(const LabelledMesh& result, MeshFormat format, const MeshStyle& style) {
  return decode_mesh(encode_mesh(result, format, {}, style), format);
}

nlohmann::json json_of(const std::string& glb) {
  std::uint32_t length = 0;
  std::memcpy(&length, glb.data() + 12, 4);
  return nlohmann::json::parse(glb.substr(20, length));
}

TEST(EncodeGltfStyle, CompressionKeepsEveryBitAndTheOrderOfAll) {
  for (const auto& member : test::mesh_family()) {
    SCOPED_TRACE(member.name);
    const LabelledMesh result = noisy_result(member.mesh);
    for (const MeshFormat format : {MeshFormat::kGlb, MeshFormat::kGltf}) {
      const DecodedMesh plain = read_back(result, format, {}), compressed = read_back(result, format, kCompressed);
      EXPECT_EQ(compressed.mesh.positions, plain.mesh.positions);
      EXPECT_EQ(compressed.mesh.triangles, plain.mesh.triangles);
    }
  }
}

TEST(EncodeGltfStyle, QuantisedPositionsAreOffByHalfAStepAtMost) {
  for (const auto& member : test::mesh_family()) {
    for (const Vec3& far : {Vec3(0, 0, 0), Vec3(500'000, 5'000'000, 300)}) {
      SCOPED_TRACE(member.name);
      LabelledMesh result = noisy_result(member.mesh);
      Eigen::AlignedBox3d box;
      for (Vec3& position : result.mesh.positions) {
        position += far;
        box.extend(position);
      }
      const double most = box.sizes().maxCoeff() / 131070 + 1e-15 * far.norm();
      for (const MeshStyle& style : {kQuantized, kBoth}) {
        const DecodedMesh decoded = read_back(result, MeshFormat::kGlb, style);
        ASSERT_EQ(decoded.mesh.positions.size(), result.mesh.positions.size());
        EXPECT_EQ(decoded.mesh.triangles, result.mesh.triangles);
        for (std::size_t v = 0; v < result.mesh.positions.size(); ++v) {
          const Vec3 off = decoded.mesh.positions[v] - result.mesh.positions[v];
          EXPECT_LE(off.lpNorm<Eigen::Infinity>(), most * (1 + 1e-9)) << v;
        }
      }
    }
  }
}

TEST(EncodeGltfStyle, EveryStepMakesTheFileSmaller) {
  const LabelledMesh result = noisy_result(test::cube(30));
  const auto bytes = [&](const MeshStyle& style) { return encode_mesh(result, MeshFormat::kGlb, {}, style).size(); };
  EXPECT_LT(bytes(kCompressed), bytes({}));
  EXPECT_LT(bytes(kQuantized), bytes({}));
  EXPECT_LT(2 * bytes(kBoth), bytes({}));
  EXPECT_LT(bytes(kBoth), bytes(kCompressed));
}

TEST(EncodeGltfStyle, TheExtensionsAreNamedAsRequired) {
  const LabelledMesh result = noisy_result(test::cube(3));
  const auto required = [&](const MeshStyle& style) {
    const auto json = json_of(encode_mesh(result, MeshFormat::kGlb, {}, style));
    return json.value("extensionsRequired", std::vector<std::string>());
  };
  using ::testing::UnorderedElementsAre;
  EXPECT_THAT(required({}), UnorderedElementsAre());
  EXPECT_THAT(required(kCompressed), UnorderedElementsAre("EXT_meshopt_compression"));
  EXPECT_THAT(required(kQuantized), UnorderedElementsAre("KHR_mesh_quantization"));
  EXPECT_THAT(required(kBoth), UnorderedElementsAre("EXT_meshopt_compression", "KHR_mesh_quantization"));
}

TEST(EncodeGltfStyle, LooksAreCompressedToo) {
  std::string text;
  const Mesh mesh = test::cube(3);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    text +=
        "v " + test::xyz(mesh.positions[v]) + fmt::format(" {} 0.25 0.75\nvt 0.5 0.0{}\n", 0.01 * double(v % 90), v);
  }
  for (const Triangle& t : mesh.triangles)
    text += fmt::format("f {0}/{0} {1}/{1} {2}/{2}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  const DecodedMesh input = decode_mesh(text, MeshFormat::kObj);
  LabelledMesh result = test::labelled(input.mesh);
  result.appearance = input.appearance;
  const auto colours = [&](const MeshStyle& style) {
    const DecodedMesh decoded = read_back(result, MeshFormat::kGlb, style);
    return vertex_colours(decoded.appearance, decoded.mesh, true);
  };
  const auto texture = [&](const MeshStyle& style) {
    const DecodedMesh decoded = read_back(result, MeshFormat::kGlb, style);
    return vertex_texture(decoded.appearance, decoded.mesh);
  };
  EXPECT_EQ(colours(kCompressed), colours({}));
  EXPECT_EQ(texture(kCompressed), texture({}));
  EXPECT_EQ(texture(kBoth), texture({}));
  const auto plain = colours({}), quantized = colours(kBoth);
  ASSERT_EQ(plain.size(), quantized.size());
  for (std::size_t v = 0; v < plain.size(); ++v) {
    EXPECT_THAT(quantized[v], ::testing::Pointwise(::testing::FloatNear(0.5F / 65535 + 1e-7F), plain[v]));
  }
}

}  // namespace
}  // namespace crease
