#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "core/io/decode.h"
#include "core/io/encode.h"
#include "core/io/write_gltf_corners.h"
#include "tests/support/labelled_meshes.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

using test::labelled;

/// A file as parsed by an independent reader.
class Gltf {
 public:
  explicit Gltf(const std::string& bytes) {
    std::string errors, warnings;
    tinygltf::TinyGLTF reader;
    const bool is_binary = bytes.substr(0, 4) == "glTF";
    const auto size = static_cast<unsigned int>(bytes.size());
    const bool read = is_binary
                          ? reader.LoadBinaryFromMemory(&model_, &errors, &warnings,
                                                        reinterpret_cast<const unsigned char*>(bytes.data()), size)
                          : reader.LoadASCIIFromString(&model_, &errors, &warnings, bytes.data(), size, "");
    EXPECT_TRUE(read) << errors;
    EXPECT_EQ(warnings, "");
  }

  const tinygltf::Model& model() const { return model_; }
  const std::vector<tinygltf::Primitive>& primitives() const { return model_.meshes.at(0).primitives; }

  /// That positions are relative to.
  Vec3 origin() const {
    const std::vector<double>& translation = model_.nodes.at(0).translation;
    return translation.empty() ? Vec3::Zero() : Vec3(translation[0], translation[1], translation[2]);
  }

  template <typename Item>
  std::vector<Item> items(int accessor_index) const {
    const auto& accessor = model_.accessors.at(static_cast<std::size_t>(accessor_index));
    const auto& view = model_.bufferViews.at(static_cast<std::size_t>(accessor.bufferView));
    EXPECT_EQ(view.byteLength, accessor.count * sizeof(Item));
    EXPECT_EQ(view.byteOffset % 4, 0U);
    std::vector<Item> result(accessor.count);
    std::memcpy(result.data(), model_.buffers.at(0).data.data() + view.byteOffset, view.byteLength);
    return result;
  }

  template <typename Item>
  std::vector<Item> attribute(const std::string& name, std::size_t primitive = 0) const {
    return items<Item>(primitives().at(primitive).attributes.at(name));
  }

 private:
  tinygltf::Model model_;
};

using Single3 = std::array<float, 3>;

Single3 in_single(const Vec3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

TEST(EncodeGltf, CopiesNameTheirSource) {
  for (const auto& member : test::mesh_family()) {
    for (const MeshFormat format : {MeshFormat::kGlb, MeshFormat::kGltf}) {
      SCOPED_TRACE(member.name + " as " + std::string(format_name(format)));
      const Mesh& mesh = member.mesh;
      const Gltf file(encode_mesh(labelled(mesh), format));
      const auto positions = file.attribute<Single3>("POSITION");
      const auto sources = file.attribute<float>("_SOURCE");
      ASSERT_GE(positions.size(), mesh.positions.size());
      ASSERT_EQ(positions.size(), sources.size());
      for (std::size_t v = 0; v < positions.size(); ++v) {
        const auto source = static_cast<std::size_t>(sources[v]);
        if (v < mesh.positions.size()) {
          EXPECT_EQ(source, v);
        }
        EXPECT_EQ(positions[v], in_single(mesh.positions.at(source) - file.origin()));
      }
      std::vector<Triangle> folded;
      const auto indices = file.items<Index>(file.primitives()[0].indices);
      for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
        folded.push_back({static_cast<Index>(sources[indices[i]]), static_cast<Index>(sources[indices[i + 1]]),
                          static_cast<Index>(sources[indices[i + 2]])});
      }
      EXPECT_EQ(folded, mesh.triangles);
    }
  }
}

TEST(EncodeGltf, NormalsAreUnitAndCloseToThoseOfSmoothFaces) {
  for (const auto& member : test::mesh_family()) {
    SCOPED_TRACE(member.name);
    const Gltf file(encode_mesh(labelled(member.mesh), MeshFormat::kGlb));
    for (const Single3& n : file.attribute<Single3>("NORMAL")) EXPECT_NEAR(std::hypot(n[0], n[1], n[2]), 1, 1e-6);
  }
  const SplitMesh split = split_along_ridges(labelled(test::icosphere(3)));
  EXPECT_EQ(split.source.size(), test::icosphere(3).positions.size());
  const Mesh sphere = test::icosphere(3);
  for (std::size_t v = 0; v < split.normals.size(); ++v) {
    EXPECT_GT(split.normals[v].dot(sphere.positions[v]), 0.999);
  }
}

TEST(EncodeGltf, RidgesShadeCrisply) {
  const auto [mesh, ridges] = test::cad_part(2);
  const SplitMesh split = split_along_ridges(labelled(mesh));
  const std::vector<Vec3> normals = face_normals(mesh, build_topology(mesh), mesh.positions);
  for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
    for (const Index corner : split.triangles[face]) {
      EXPECT_GT(split.normals[corner].dot(normals[face]), std::cos(12.0 / 180 * M_PI));
    }
  }
  std::set<Index> on_ridges;
  for (const auto& [v0, v1] : ridges) on_ridges.insert({v0, v1});
  std::set<Index> split_vertices(split.source.begin() + static_cast<std::ptrdiff_t>(mesh.positions.size()),
                                 split.source.end());
  EXPECT_EQ(split_vertices, on_ridges);
}

TEST(EncodeGltf, ACubeHasThreeNormalsAtEachCornerAndTwoAlongEachRidge) {
  const int per_side = 4;
  const SplitMesh split = split_along_ridges(labelled(test::cube(per_side)));
  std::map<Index, int> normals_at;
  for (const Index source : split.source) ++normals_at[source];
  std::map<int, int> vertices_with;
  for (const auto& [vertex, count] : normals_at) ++vertices_with[count];
  EXPECT_EQ(vertices_with, (std::map<int, int>{{1, 6 * 9}, {2, 12 * 3}, {3, 8}}));
}

TEST(EncodeGltf, ARidgeThatEndsInsideTheSurfaceSplitsNoVertexAtItsEnd) {
  LabelledMesh result = labelled(test::grid(6, 6));
  const auto index_at = [&](double x, double y) {
    return static_cast<Index>(std::find(result.mesh.positions.begin(), result.mesh.positions.end(), Vec3(x, y, 0)) -
                              result.mesh.positions.begin());
  };
  const Index inner = index_at(2, 3), middle = index_at(3, 3), outer = index_at(4, 3);
  for (std::size_t e = 0; e < result.edges.size(); ++e) {
    const std::set<Index> ends = {result.edges[e].v0, result.edges[e].v1};
    if (ends == std::set{inner, middle} || ends == std::set{middle, outer}) result.labels[e] = 0.5;
  }
  const SplitMesh split = split_along_ridges(result);
  ASSERT_EQ(split.source.size(), result.mesh.positions.size() + 1);
  EXPECT_EQ(split.source.back(), middle);
}

TEST(EncodeGltf, FacesOfOppositeWindingDoNotShareANormal) {
  Mesh mesh = test::grid(1, 1);
  std::swap(mesh.triangles[1][1], mesh.triangles[1][2]);
  const SplitMesh split = split_along_ridges(labelled(mesh));
  EXPECT_EQ(split.source.size(), 6U);
  for (const Index corner : split.triangles[0]) EXPECT_EQ(split.normals[corner], Vec3(0, 0, 1));
  for (const Index corner : split.triangles[1]) EXPECT_EQ(split.normals[corner], Vec3(0, 0, -1));
}

TEST(EncodeGltf, AVertexHasTheLargestLabelOfItsEdges) {
  LabelledMesh result = labelled(test::cad_part(1).mesh);
  for (std::size_t e = 0; e < result.labels.size(); ++e) result.labels[e] = 0.9 * std::abs(std::sin(double(e)));
  const Gltf file(encode_mesh(result, MeshFormat::kGlb));
  const auto sources = file.attribute<float>("_SOURCE"), labels = file.attribute<float>("_LABEL");
  for (std::size_t v = 0; v < sources.size(); ++v) {
    float expected = 0;
    for (std::size_t e = 0; e < result.edges.size(); ++e) {
      const auto source = static_cast<Index>(sources[v]);
      if (result.edges[e].v0 == source || result.edges[e].v1 == source) {
        expected = std::max(expected, static_cast<float>(result.labels[e]));
      }
    }
    EXPECT_EQ(labels[v], expected);
  }
}

TEST(EncodeGltf, RidgesAreLinesAndAreOmittedWhenThereAreNone) {
  const auto [mesh, ridges] = test::cad_part(2);
  const Gltf file(encode_mesh(labelled(mesh), MeshFormat::kGlb));
  ASSERT_EQ(file.primitives().size(), 2U);
  EXPECT_EQ(file.primitives()[0].mode, TINYGLTF_MODE_TRIANGLES);
  EXPECT_EQ(file.primitives()[1].mode, TINYGLTF_MODE_LINE);
  EXPECT_TRUE(file.primitives()[1].attributes.contains("_LABEL"));
  const auto indices = file.items<Index>(file.primitives()[1].indices);
  std::set<std::pair<Index, Index>> drawn, expected;
  for (std::size_t i = 0; i < indices.size(); i += 2) drawn.emplace(indices[i], indices[i + 1]);
  for (const auto& [v0, v1] : ridges) expected.emplace(v0, v1);
  EXPECT_EQ(drawn, expected);
  EXPECT_EQ(Gltf(encode_mesh(labelled(test::grid(3, 3)), MeshFormat::kGlb)).primitives().size(), 1U);
}

TEST(EncodeGltf, HasOneNodeOneMeshAndTheBoundsOfThePositions) {
  const Mesh mesh = test::icosphere(2, 3.3);
  const Gltf file(encode_mesh(labelled(mesh), MeshFormat::kGlb));
  EXPECT_EQ(file.model().nodes.size(), 1U);
  EXPECT_EQ(file.model().meshes.size(), 1U);
  EXPECT_EQ(file.model().scenes.size(), 1U);
  EXPECT_EQ(file.model().buffers.size(), 1U);
  const auto positions = file.attribute<Single3>("POSITION");
  const auto& accessor =
      file.model().accessors.at(static_cast<std::size_t>(file.primitives()[0].attributes.at("POSITION")));
  for (std::size_t k = 0; k < 3; ++k) {
    const auto less = [&](const Single3& a, const Single3& b) { return a[k] < b[k]; };
    const auto [low, high] = std::minmax_element(positions.begin(), positions.end(), less);
    EXPECT_EQ(accessor.minValues.at(k), (*low)[k]);
    EXPECT_EQ(accessor.maxValues.at(k), (*high)[k]);
  }
}

TEST(EncodeGltf, ExtrasAreKept) {
  const nlohmann::ordered_json extras = {{"job", "abc"}, {"seed", 4'294'967'295U},    {"weight", 0.25},
                                         {"on", true},   {"counts", {{"faces", -2}}}, {"list", {1, "x"}}};
  const std::string bytes = encode_mesh(labelled(test::cube(1)), MeshFormat::kGltf, extras);
  const auto read = nlohmann::json::parse(bytes)["asset"]["extras"];
  EXPECT_EQ(read, nlohmann::json(extras));
}

TEST(EncodeGltf, OurReaderReadsItBack) {
  for (const auto& member : test::mesh_family()) {
    for (const MeshFormat format : {MeshFormat::kGlb, MeshFormat::kGltf}) {
      SCOPED_TRACE(member.name + " as " + std::string(format_name(format)));
      const Mesh decoded = decode_mesh(encode_mesh(labelled(member.mesh), format), format).mesh;
      ASSERT_EQ(decoded.triangles.size(), member.mesh.triangles.size());
      for (std::size_t face = 0; face < decoded.triangles.size(); ++face) {
        for (std::size_t k = 0; k < 3; ++k) {
          EXPECT_EQ(in_single(decoded.positions[decoded.triangles[face][k]]),
                    in_single(member.mesh.positions[member.mesh.triangles[face][k]]));
        }
      }
    }
  }
}

/// UTM coordinates once came back rounded to half a metre.
TEST(EncodeGltf, AMeshThatIsFarAwayKeepsItsShape) {
  const Mesh near = test::icosphere(2);
  Mesh far = near;
  const Vec3 place(448'000.25, 5'412'000.5, 312.75);
  for (Vec3& position : far.positions) position += place;
  for (const MeshFormat format : {MeshFormat::kGlb, MeshFormat::kGltf}) {
    const std::string bytes = encode_mesh(labelled(far), format);
    const Mesh back = decode_mesh(bytes, format).mesh;
    ASSERT_EQ(back.positions.size(), near.positions.size());
    for (std::size_t v = 0; v < near.positions.size(); ++v) {
      EXPECT_LT((back.positions[v] - far.positions[v]).norm(), 1e-6) << v;
    }
  }
  EXPECT_TRUE(Gltf(encode_mesh(labelled(near), MeshFormat::kGlb)).model().nodes.at(0).translation.empty());
}

TEST(EncodeGltf, TheSurfaceIsMatteAndRidgesAreUnlit) {
  const Gltf file(encode_mesh(labelled(test::cad_part(2).mesh), MeshFormat::kGlb));
  const auto& materials = file.model().materials;
  const auto material_of = [&](std::size_t primitive) {
    return materials.at(static_cast<std::size_t>(file.primitives().at(primitive).material));
  };
  EXPECT_EQ(material_of(0).pbrMetallicRoughness.metallicFactor, 0);
  EXPECT_TRUE(material_of(1).extensions.contains("KHR_materials_unlit"));
  EXPECT_EQ(file.model().extensionsUsed, std::vector<std::string>{"KHR_materials_unlit"});
  EXPECT_FALSE(file.model().nodes.at(0).name.empty());
  EXPECT_FALSE(file.model().meshes.at(0).name.empty());
}

}  // namespace
}  // namespace crease
