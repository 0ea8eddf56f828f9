#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/encode.h"
#include "core/measure/noise.h"
#include "tests/support/labelled_meshes.h"
#include "tests/support/meshes.h"
#include "tests/unit/decode_samples.h"

namespace crease {
namespace {

using test::GltfSample;

constexpr const char* kExtension = "KHR_draco_mesh_compression";

struct Encoded {
  std::string bytes;
  std::size_t points = 0, faces = 0;
};

/// The mesh by Draco's own encoder, with texture coordinates x and y; `bits` of 0 keeps floats as they are.
Encoded encoded(const Mesh& mesh, draco::MeshEncoderMethod method, int bits) {
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(static_cast<int>(mesh.triangles.size()));
  const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int texture = builder.AddAttribute(draco::GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32);
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    std::array<Eigen::Vector3f, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) corners[k] = mesh.positions[mesh.triangles[f][k]].cast<float>();
    const draco::FaceIndex face(f);
    builder.SetAttributeValuesForFace(position, face, corners[0].data(), corners[1].data(), corners[2].data());
    builder.SetAttributeValuesForFace(texture, face, corners[0].data(), corners[1].data(), corners[2].data());
  }
  const std::unique_ptr<draco::Mesh> soup = builder.Finalize();
  draco::Encoder encoder;
  encoder.SetEncodingMethod(method);
  if (bits > 0) encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, bits);
  encoder.SetTrackEncodedProperties(true);
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(*soup, &buffer).ok());
  return {std::string(buffer.data(), buffer.size()), encoder.num_encoded_points(), encoder.num_encoded_faces()};
}

GltfSample sample_of(const Encoded& data) {
  GltfSample sample = test::gltf_sample({{{0, 0, 0}}, {}});
  sample.json["bufferViews"] = nlohmann::json::array();
  sample.json["accessors"] = {{{"componentType", 5126}, {"type", "VEC3"}, {"count", data.points}},
                              {{"componentType", 5126}, {"type", "VEC2"}, {"count", data.points}},
                              {{"componentType", 5125}, {"type", "SCALAR"}, {"count", 3 * data.faces}}};
  sample.buffer.clear();
  sample.add(data.bytes, 5121, "SCALAR", data.bytes.size());
  sample.json["accessors"].erase(3);
  sample.json["extensionsUsed"] = sample.json["extensionsRequired"] = {kExtension};
  sample.primitive() = {
      {"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}}},
      {"indices", 2},
      {"extensions", {{kExtension, {{"bufferView", 0}, {"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}}}}}}}};
  return sample;
}

/// The corners of all faces, each face from its least corner on, sorted: what does not depend on the order in which
/// Draco stores faces and vertices.
std::vector<std::array<double, 9>> faces_of(const Mesh& mesh) {
  std::vector<std::array<double, 9>> faces;
  for (const Triangle& triangle : mesh.triangles) {
    std::array<std::array<double, 3>, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = mesh.positions[triangle[k]];
      corners[k] = {p.x(), p.y(), p.z()};
    }
    std::rotate(corners.begin(), std::ranges::min_element(corners), corners.end());
    std::array<double, 9> flat{};
    for (std::size_t i = 0; i < 9; ++i) flat[i] = corners[i / 3][i % 3];
    faces.push_back(flat);
  }
  std::ranges::sort(faces);
  return faces;
}

constexpr auto kSequential = draco::MESH_SEQUENTIAL_ENCODING, kEdgebreaker = draco::MESH_EDGEBREAKER_ENCODING;

TEST(DecodeDraco, TheMeshIsThatOfTheEncoder) {
  const Mesh mesh = test::in_single_precision(add_noise(test::cube(4), 0.1, 3, NoiseKind::kGaussian));
  for (const auto method : {kSequential, kEdgebreaker}) {
    const GltfSample sample = sample_of(encoded(mesh, method, 0));
    for (const std::string& bytes : {sample.glb(), sample.gltf()}) {
      const DecodedMesh decoded = decode_mesh(bytes, std::nullopt);
      EXPECT_EQ(decoded.mesh.positions.size(), mesh.positions.size());
      EXPECT_EQ(faces_of(decoded.mesh), faces_of(mesh));
      ASSERT_EQ(decoded.appearance.texture.size(), 1U);
      for (std::size_t f = 0; f < decoded.mesh.triangles.size(); ++f) {
        for (std::size_t k = 0; k < 3; ++k) {
          const Vec3& position = decoded.mesh.positions[decoded.mesh.triangles[f][k]];
          const auto& set = decoded.appearance.texture[0];
          const auto& uv = set.values[set.at(decoded.mesh.triangles, f, k)];
          EXPECT_EQ(uv, (std::array<float, 2>{static_cast<float>(position.x()), static_cast<float>(position.y())}));
        }
      }
    }
  }
}

TEST(DecodeDraco, QuantisedPositionsAreWithinHalfAStep) {
  const Mesh mesh = add_noise(test::cube(4), 0.1, 3, NoiseKind::kGaussian);
  const DecodedMesh decoded = decode_mesh(sample_of(encoded(mesh, kSequential, 12)).glb(), MeshFormat::kGlb);
  const auto is = faces_of(decoded.mesh), expected = faces_of(mesh);
  ASSERT_EQ(is.size(), expected.size());
  const double step = 1.5 / 4095;  // of an extent below 1.5
  ASSERT_EQ(decoded.mesh.positions.size(), mesh.positions.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    double nearest = 1;
    for (const Vec3& p : mesh.positions) {
      nearest = std::min(nearest, (p - decoded.mesh.positions[v]).lpNorm<Eigen::Infinity>());
    }
    EXPECT_LT(nearest, step);
  }
}

TEST(DecodeDraco, OriginalsComeBackWithoutCompression) {
  const Mesh mesh = test::in_single_precision(test::cube(3));
  const std::string upload = sample_of(encoded(mesh, kEdgebreaker, 0)).glb();
  const DecodedMesh before = decode_mesh(upload, MeshFormat::kGlb);
  LabelledMesh result = test::labelled(before.mesh);
  for (Vec3& position : result.mesh.positions) position.x() += 0.25;
  const std::string bytes = encode_original(upload, MeshFormat::kGlb, result);
  EXPECT_EQ(bytes.find(kExtension), std::string::npos);
  const DecodedMesh after = decode_mesh(bytes, MeshFormat::kGlb);
  EXPECT_EQ(after.mesh.positions, test::in_single_precision(result.mesh).positions);
  EXPECT_EQ(after.mesh.triangles, before.mesh.triangles);
  EXPECT_EQ(after.appearance.texture[0].values, before.appearance.texture[0].values);
}

/// A header with counts that no data follows: they must be refused before memory is reserved for them.
TEST(DecodeDraco, HostileCountsAreRefusedByTheirNumbers) {
  const auto varint = [](std::uint32_t value) {
    std::string bytes;
    for (; value >= 128; value >>= 7U) bytes += static_cast<char>((value & 127U) | 128U);
    return bytes + static_cast<char>(value);
  };
  const std::string head("DRACO\x02\x02\x01", 8), flags("\0\0", 2);
  const std::uint32_t many = 0x3fffffff;
  for (const auto& [data, what] :
       {std::pair(head + std::string("\0", 1) + flags + varint(many) + varint(5), "faces"),
        std::pair(head + std::string("\0", 1) + flags + varint(5) + varint(many), "vertices"),
        std::pair(head + "\x01" + flags + std::string("\0", 1) + varint(5) + varint(many), "faces"),
        std::pair(head + "\x01" + flags + std::string("\0", 1) + varint(many) + varint(5), "vertices")}) {
    const auto error = test::refusal(sample_of({data, 5, 5}).glb());
    ASSERT_TRUE(error.has_value());
    EXPECT_EQ(error->code(), code::kMeshTooLarge);
    EXPECT_NE(error->detail().find(what), std::string::npos) << error->detail();
  }
}

TEST(DecodeDraco, WhatDoesNotFitIsRefused) {
  const Encoded good = encoded(test::cube(2), kEdgebreaker, 11);
  const auto code_of = [](const GltfSample& sample) {
    const auto error = test::refusal(sample.glb());
    return error ? std::optional(error->code()) : std::nullopt;
  };
  EXPECT_EQ(code_of(sample_of(good)), std::nullopt);
  Encoded cut = good;
  cut.bytes.resize(cut.bytes.size() / 2);
  EXPECT_EQ(code_of(sample_of(cut)), code::kMeshSyntax);
  EXPECT_EQ(code_of(sample_of({"no draco", 4, 4})), code::kMeshSyntax);
  Encoded more = good;
  ++more.points;
  EXPECT_EQ(code_of(sample_of(more)), code::kMeshCountMismatch);
  more = good;
  ++more.faces;
  EXPECT_EQ(code_of(sample_of(more)), code::kMeshCountMismatch);
  GltfSample unknown = sample_of(good);
  unknown.primitive()["extensions"][kExtension]["attributes"]["POSITION"] = 7;
  EXPECT_EQ(code_of(unknown), code::kMeshSyntax);
  GltfSample strip = sample_of(good);
  strip.primitive()["mode"] = 5;
  EXPECT_EQ(code_of(strip), code::kMeshUnsupported);
}

}  // namespace
}  // namespace crease
