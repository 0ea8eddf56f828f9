#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.h"
#include "core/io/decode.h"
#include "core/io/encode.h"
#include "core/measure/noise.h"
#include "tests/support/labelled_meshes.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

using test::labelled;

/// A mesh whose coordinates use all their digits.
Mesh ragged(const Mesh& mesh) { return add_noise(mesh, 0.01, 9, NoiseKind::kGaussian); }

Vec3 to_single(Vec3 position) {
  for (double& coordinate : position) {
    const volatile auto single = static_cast<float>(coordinate);  // without volatile, gcc 12 at -O3 drops the rounding
    coordinate = static_cast<double>(single);
  }
  return position;
}

std::optional<ErrorCode> code_of_refusal(const Mesh& mesh, MeshFormat format, std::string* place = nullptr) {
  try {
    encode_mesh(labelled(mesh), format);
  } catch (const Error& error) {
    if (place != nullptr) *place = error.place();
    return error.code();
  }
  return std::nullopt;
}

TEST(EncodeFormats, TextAndPlyReadBackExactly) {
  for (const auto& member : test::mesh_family()) {
    const Mesh mesh = ragged(member.mesh);
    for (const MeshFormat format : {MeshFormat::kObj, MeshFormat::kOff, MeshFormat::kPly}) {
      SCOPED_TRACE(member.name + " as " + std::string(format_name(format)));
      const DecodedMesh decoded = decode_mesh(encode_mesh(labelled(mesh), format), format);
      EXPECT_EQ(decoded.mesh.positions, mesh.positions);
      EXPECT_EQ(decoded.mesh.triangles, mesh.triangles);
      EXPECT_TRUE(decoded.warnings.empty());
    }
  }
}

TEST(EncodeFormats, WrittenFilesAreRecognisedByTheirBytes) {
  const LabelledMesh result = labelled(test::cube(2));
  for (const MeshFormat format : kMeshFormats) {
    if (format_row(format).read == nullptr || format_row(format).write == nullptr) continue;
    SCOPED_TRACE(format_name(format));
    EXPECT_EQ(decode_mesh(encode_mesh(result, format), std::nullopt).format, format);
  }
}

TEST(EncodeFormats, ExtremeCoordinatesReadBackExactly) {
  Mesh mesh = test::cube(1);
  mesh.positions[0] = {std::numeric_limits<double>::denorm_min(), std::numeric_limits<double>::max(), -0.0};
  mesh.positions[1] = {std::nextafter(1.0, 2.0), 0.1, -1.0 / 3};
  mesh.positions[2] = {1e22, 123456789012345678.0, 5e-324};
  for (const MeshFormat format : {MeshFormat::kObj, MeshFormat::kOff, MeshFormat::kPly}) {
    SCOPED_TRACE(format_name(format));
    EXPECT_EQ(decode_mesh(encode_mesh({mesh, {}, {}, {}}, format), format).mesh.positions, mesh.positions);
  }
}

TEST(EncodeFormats, StlKeepsFacetsInOrderInSinglePrecision) {
  for (const auto& member : test::mesh_family()) {
    SCOPED_TRACE(member.name);
    const Mesh mesh = ragged(member.mesh);
    const std::string bytes = encode_mesh(labelled(mesh), MeshFormat::kStl);
    ASSERT_EQ(bytes.size(), 84 + 50 * mesh.triangles.size());
    EXPECT_NE(bytes.substr(0, 5), "solid");
    const Mesh decoded = decode_mesh(bytes, MeshFormat::kStl).mesh;
    ASSERT_EQ(decoded.triangles.size(), mesh.triangles.size());
    for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(decoded.positions[decoded.triangles[face][k]], to_single(mesh.positions[mesh.triangles[face][k]]));
      }
    }
  }
}

TEST(EncodeFormats, StlNormalsAreUnitOrZero) {
  for (const auto& member : test::mesh_family()) {
    SCOPED_TRACE(member.name);
    const std::string bytes = encode_mesh(labelled(member.mesh), MeshFormat::kStl);
    const auto normals = face_normals(member.mesh, build_topology(member.mesh), member.mesh.positions);
    for (std::size_t face = 0; face < member.mesh.triangles.size(); ++face) {
      std::array<float, 3> normal{};
      std::memcpy(normal.data(), bytes.data() + 84 + 50 * face, sizeof normal);
      const double length = std::hypot(normal[0], normal[1], normal[2]);
      EXPECT_NEAR(length, normals[face].norm(), 1e-6);
    }
  }
}

TEST(EncodeFormats, JsonHoldsEverything) {
  for (const auto& member : test::mesh_family()) {
    SCOPED_TRACE(member.name);
    const LabelledMesh result = labelled(ragged(member.mesh));
    const auto json = nlohmann::json::parse(encode_mesh(result, MeshFormat::kJson, {{"job", "j1"}}));
    ASSERT_EQ(json["positions"].size(), result.mesh.positions.size());
    for (std::size_t v = 0; v < result.mesh.positions.size(); ++v) {
      for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(json["positions"][v][static_cast<std::size_t>(k)].get<double>(), result.mesh.positions[v][k]);
      }
    }
    EXPECT_EQ(json["triangles"].get<std::vector<Triangle>>(), result.mesh.triangles);
    ASSERT_EQ(json["edges"].size(), result.edges.size());
    for (std::size_t e = 0; e < result.edges.size(); ++e) {
      EXPECT_EQ(json["edges"][e].get<std::vector<Index>>(), (std::vector{result.edges[e].v0, result.edges[e].v1}));
      EXPECT_EQ(json["labels"][e].get<double>(), result.labels[e]);
      EXPECT_NEAR(json["dihedral_deg"][e].get<double>(), result.dihedral_rad[e] * 180 / M_PI, 1e-3);
    }
    EXPECT_EQ(json["extras"]["job"], "j1");
  }
}

TEST(EncodeFormats, OnlyGltfAndJsonContainExtras) {
  const LabelledMesh result = labelled(test::cube(2));
  const nlohmann::ordered_json extras = {{"job", "0123456789abcdef"}};
  for (const MeshFormat format : kMeshFormats) {
    SCOPED_TRACE(format_name(format));
    const bool carries = format == MeshFormat::kGltf || format == MeshFormat::kGlb || format == MeshFormat::kJson;
    EXPECT_EQ(encode_mesh(result, format, extras) != encode_mesh(result, format), carries);
    EXPECT_EQ(encode_mesh(result, format, extras).find("0123456789abcdef") != std::string::npos, carries);
  }
}

TEST(EncodeFormats, EqualResultsGiveEqualBytes) {
  const Mesh mesh = ragged(test::cad_part(2).mesh);
  for (const MeshFormat format : kMeshFormats) {
    SCOPED_TRACE(format_name(format));
    EXPECT_EQ(encode_mesh(labelled(mesh), format), encode_mesh(labelled(mesh), format));
  }
}

TEST(EncodeFormats, CoordinatesTooLargeForSinglePrecisionAreRefused) {
  Mesh mesh = test::cube(1);
  mesh.positions[3].z() = -1e39;
  for (const MeshFormat format : kMeshFormats) {
    SCOPED_TRACE(format_name(format));
    const bool is_single = format == MeshFormat::kGltf || format == MeshFormat::kGlb || format == MeshFormat::kStl;
    std::string place;
    EXPECT_EQ(code_of_refusal(mesh, format, &place), is_single ? std::optional(code::kMeshUnsupported) : std::nullopt);
    EXPECT_EQ(place, is_single ? "vertex 3" : "");
  }
}

TEST(EncodeFormats, GltfCannotHoldAMeshWithoutFaces) {
  EXPECT_EQ(code_of_refusal({{{0, 0, 0}}, {}}, MeshFormat::kGlb), code::kMeshNoFaces);
}

}  // namespace
}  // namespace crease
