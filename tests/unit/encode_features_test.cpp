#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <set>

#include "core/error.h"
#include "core/features/features.h"
#include "core/io/decode.h"
#include "core/io/encode.h"
#include "core/io/write_gltf_corners.h"
#include "tests/support/labelled_meshes.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

using test::labelled;

tinygltf::Model read(const std::string& glb) {
  tinygltf::Model model;
  std::string errors, warnings;
  EXPECT_TRUE(tinygltf::TinyGLTF().LoadBinaryFromMemory(&model, &errors, &warnings,
                                                        reinterpret_cast<const unsigned char*>(glb.data()),
                                                        static_cast<unsigned int>(glb.size())))
      << errors;
  return model;
}

template <typename Item>
std::vector<Item> items(const tinygltf::Model& model, int accessor_index) {
  const auto& accessor = model.accessors.at(static_cast<std::size_t>(accessor_index));
  const auto& view = model.bufferViews.at(static_cast<std::size_t>(accessor.bufferView));
  std::vector<Item> result(accessor.count);
  EXPECT_EQ(view.byteLength, accessor.count * sizeof(Item));
  std::memcpy(result.data(), model.buffers.at(0).data.data() + view.byteOffset, view.byteLength);
  return result;
}

Features features_of(const LabelledMesh& result) {
  return find_features(result.mesh, build_topology(result.mesh), result.mesh.positions, result.labels);
}

LabelledMesh with_features(const Mesh& mesh) {
  LabelledMesh result = labelled(mesh);
  Features features = features_of(result);
  result.classes = std::move(features.classes);
  result.segments = std::move(features.segments);
  result.ridge_lines = std::move(features.ridge_lines);
  result.corners = std::move(features.corners);
  return result;
}

TEST(EncodeFeatures, GlbVerticesHaveTheClassOfTheirSourceAndTheSegmentOfTheirFaces) {
  for (const auto& member : test::mesh_family()) {
    SCOPED_TRACE(member.name);
    const LabelledMesh result = with_features(member.mesh);
    const tinygltf::Model model = read(encode_mesh(result, MeshFormat::kGlb));
    const tinygltf::Primitive& faces = model.meshes.at(0).primitives.at(0);
    const auto sources = items<float>(model, faces.attributes.at("_SOURCE"));
    const auto classes = items<float>(model, faces.attributes.at("_CLASS"));
    const auto segments = items<float>(model, faces.attributes.at("_SEGMENT"));
    const auto indices = items<Index>(model, faces.indices);
    ASSERT_EQ(classes.size(), sources.size());
    ASSERT_EQ(segments.size(), sources.size());
    for (std::size_t v = 0; v < sources.size(); ++v) {
      const auto source = static_cast<std::size_t>(sources[v]);
      if (v < member.mesh.positions.size()) {
        EXPECT_EQ(source, v);
      }
      EXPECT_EQ(classes[v], static_cast<float>(result.classes[source]));
    }
    std::set<Index> used(indices.begin(), indices.end());
    for (std::size_t i = 0; i < indices.size(); ++i) {
      EXPECT_EQ(segments[indices[i]], static_cast<float>(result.segments[i / 3]));
      EXPECT_EQ(sources[indices[i]], static_cast<float>(member.mesh.triangles[i / 3][i % 3]));
    }
    for (Index v = 0; v < segments.size(); ++v) EXPECT_EQ(segments[v] < 0, !used.contains(v));
  }
}

/// A result with a distinct deviation for each vertex.
LabelledMesh with_sigma(const Mesh& mesh) {
  LabelledMesh result = labelled(mesh);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) result.sigma.push_back(static_cast<double>(v) / 7);
  return result;
}

TEST(EncodeFeatures, DeviationsOfVerticesAreInGltfPlyAndJsonOnlyWhenTheyAreKnown) {
  const Mesh cube = test::cube(3);
  const LabelledMesh result = with_sigma(cube);
  const tinygltf::Model model = read(encode_mesh(result, MeshFormat::kGlb));
  const tinygltf::Primitive& faces = model.meshes.at(0).primitives.at(0);
  const auto sources = items<float>(model, faces.attributes.at("_SOURCE"));
  const auto sigma = items<float>(model, faces.attributes.at("_SIGMA"));
  ASSERT_EQ(sigma.size(), sources.size());
  for (std::size_t v = 0; v < sigma.size(); ++v) {
    EXPECT_EQ(sigma[v], static_cast<float>(result.sigma[static_cast<std::size_t>(sources[v])]));
  }
  const auto json = nlohmann::json::parse(encode_mesh(result, MeshFormat::kJson));
  EXPECT_EQ(json["sigma"].get<std::vector<double>>(), result.sigma);

  const std::string ply = encode_mesh(result, MeshFormat::kPly);
  const DecodedMesh read_back = decode_mesh(ply, MeshFormat::kPly);
  EXPECT_EQ(read_back.mesh.positions, cube.positions);
  EXPECT_EQ(read_back.mesh.triangles, cube.triangles);
  const std::size_t body = ply.find("end_header\n") + std::string_view("end_header\n").size();
  for (std::size_t v = 0; v < cube.positions.size(); ++v) {
    double written = -1;
    std::memcpy(&written, ply.data() + body + 32 * v + 24, sizeof written);
    EXPECT_EQ(written, result.sigma[v]);
  }

  const LabelledMesh plain = labelled(cube);
  EXPECT_FALSE(nlohmann::json::parse(encode_mesh(plain, MeshFormat::kJson)).contains("sigma"));
  EXPECT_EQ(encode_mesh(plain, MeshFormat::kPly).find("sigma"), std::string::npos);
  const tinygltf::Model without = read(encode_mesh(plain, MeshFormat::kGlb));
  EXPECT_FALSE(without.meshes.at(0).primitives.at(0).attributes.contains("_SIGMA"));
}

TEST(EncodeFeatures, PlyHasTheLabelOfEveryEdge) {
  const LabelledMesh result = labelled(test::cube(2));
  const std::string ply = encode_mesh(result, MeshFormat::kPly);
  EXPECT_NE(ply.find(fmt::format("element edge {}\n", result.edges.size())), std::string::npos);
  constexpr std::size_t kEdgeBytes = 16;
  ASSERT_GT(ply.size(), kEdgeBytes * result.edges.size());
  const char* edge = ply.data() + ply.size() - kEdgeBytes * result.edges.size();
  for (std::size_t e = 0; e < result.edges.size(); ++e, edge += kEdgeBytes) {
    std::array<Index, 2> ends{};
    std::array<float, 2> numbers{};
    std::memcpy(ends.data(), edge, sizeof ends);
    std::memcpy(numbers.data(), edge + sizeof ends, sizeof numbers);
    EXPECT_EQ(ends, (std::array{result.edges[e].v0, result.edges[e].v1}));
    EXPECT_FLOAT_EQ(numbers[0], static_cast<float>(result.labels[e]));
    EXPECT_NEAR(numbers[1], result.dihedral_rad[e] * 180 / std::numbers::pi, 1e-4);
  }
  EXPECT_EQ(encode_mesh({test::cube(2), {}, {}, {}}, MeshFormat::kPly).find("edge"), std::string::npos);
}

TEST(EncodeFeatures, SegmentsSplitVerticesButNotNormals) {
  LabelledMesh sphere = labelled(test::icosphere(2));
  const SplitMesh whole = split_along_ridges(sphere);
  ASSERT_EQ(whole.source.size(), sphere.mesh.positions.size());
  sphere.segments.assign(sphere.mesh.triangles.size(), 0);
  EXPECT_EQ(split_along_ridges(sphere).source, whole.source);
  std::fill(sphere.segments.begin() + 100, sphere.segments.end(), 1);
  const SplitMesh parted = split_along_ridges(sphere);
  EXPECT_GT(parted.source.size(), whole.source.size());
  for (std::size_t v = 0; v < parted.source.size(); ++v) {
    EXPECT_EQ(parted.normals[v], whole.normals[parted.source[v]]);
  }
}

TEST(EncodeFeatures, AFaceOfNoSegmentHasSegmentMinusOne) {
  LabelledMesh result = with_features(test::cube(3));
  result.segments[4] = kNone;
  const auto json = nlohmann::json::parse(encode_mesh(result, MeshFormat::kJson));
  EXPECT_EQ(json["segments"][4], -1);
  EXPECT_EQ(json["segments"][5], result.segments[5]);
  const tinygltf::Model model = read(encode_mesh(result, MeshFormat::kGlb));
  const tinygltf::Primitive& faces = model.meshes.at(0).primitives.at(0);
  const auto segments = items<float>(model, faces.attributes.at("_SEGMENT"));
  const auto indices = items<Index>(model, faces.indices);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(segments[indices[3 * 4 + k]], -1.0F);
}

TEST(EncodeFeatures, JsonMeshesListFeaturesOnlyWhenTheyAreKnown) {
  const LabelledMesh result = with_features(test::cube(3));
  const auto json = nlohmann::json::parse(encode_mesh(result, MeshFormat::kJson));
  ASSERT_EQ(json["classes"].size(), result.classes.size());
  for (std::size_t v = 0; v < result.classes.size(); ++v) {
    EXPECT_EQ(json["classes"][v], static_cast<int>(result.classes[v]));
  }
  EXPECT_EQ(json["segments"].get<std::vector<Index>>(), result.segments);
  const auto plain = nlohmann::json::parse(encode_mesh(labelled(test::cube(3)), MeshFormat::kJson));
  EXPECT_FALSE(plain.contains("classes"));
  EXPECT_FALSE(plain.contains("segments"));
  const tinygltf::Model model = read(encode_mesh(labelled(test::cube(3)), MeshFormat::kGlb));
  EXPECT_FALSE(model.meshes.at(0).primitives.at(0).attributes.contains("_CLASS"));
  EXPECT_FALSE(model.meshes.at(0).primitives.at(0).attributes.contains("_SEGMENT"));
}

TEST(EncodeFeatures, RidgeLinesAsJson) {
  const LabelledMesh part = labelled(test::cad_part(3).mesh);
  const Features features = features_of(part);
  const auto json = nlohmann::json::parse(write_ridges_json(with_features(part.mesh), {}));
  EXPECT_EQ(json["count"], features.ridge_lines.size());
  EXPECT_EQ(json["corners"].get<std::vector<Index>>(), features.corners);
  ASSERT_EQ(json["ridges"].size(), features.ridge_lines.size());
  for (std::size_t i = 0; i < features.ridge_lines.size(); ++i) {
    const RidgeLine& line = features.ridge_lines[i];
    const auto& written = json["ridges"][i];
    EXPECT_EQ(written["vertices"].get<std::vector<Index>>(), line.vertices);
    EXPECT_EQ(written["closed"], line.closed);
    EXPECT_NEAR(written["length"].get<double>(), line.length, 1e-5 * line.length);
    EXPECT_NEAR(written["mean_label"].get<double>(), line.mean_label, 1e-5);
    EXPECT_NEAR(written["mean_dihedral_deg"].get<double>(), line.mean_dihedral_rad * 180 / M_PI, 1e-3);
  }
  const auto none = nlohmann::json::parse(write_ridges_json({}, {}));
  EXPECT_EQ(none["count"], 0);
  EXPECT_TRUE(none["ridges"].empty() && none["corners"].empty());
}

TEST(EncodeFeatures, RidgeLinesAsGlb) {
  for (const Mesh& mesh : {test::cad_part(3).mesh, test::cylinder(24, 4, 1, 2)}) {
    const LabelledMesh part = labelled(mesh);
    const tinygltf::Model model = read(write_ridges_glb(with_features(mesh), {{"job", "abc"}}));
    EXPECT_EQ(model.nodes.size(), 1U);
    ASSERT_EQ(model.meshes.size(), 1U);
    ASSERT_EQ(model.meshes[0].primitives.size(), 1U);
    const tinygltf::Primitive& drawn = model.meshes[0].primitives[0];
    EXPECT_EQ(drawn.mode, TINYGLTF_MODE_LINE);
    const auto sources = items<float>(model, drawn.attributes.at("_SOURCE"));
    const auto numbers = items<float>(model, drawn.attributes.at("_LINE"));
    const auto positions = items<std::array<float, 3>>(model, drawn.attributes.at("POSITION"));
    const auto indices = items<Index>(model, drawn.indices);
    std::set<std::pair<Index, Index>> edges, expected;
    for (std::size_t i = 0; i < indices.size(); i += 2) {
      EXPECT_EQ(numbers[indices[i]], numbers[indices[i + 1]]);
      edges.insert(std::minmax(static_cast<Index>(sources[indices[i]]), static_cast<Index>(sources[indices[i + 1]])));
    }
    for (std::size_t e = 0; e < part.edges.size(); ++e) {
      if (part.labels[e] >= kRidgeThreshold) expected.emplace(part.edges[e].v0, part.edges[e].v1);
    }
    EXPECT_EQ(edges, expected);
    EXPECT_EQ(2 * edges.size(), indices.size());
    for (std::size_t v = 0; v < sources.size(); ++v) {
      const Vec3& position = mesh.positions[static_cast<std::size_t>(sources[v])];
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(positions[v][k], static_cast<float>(position[static_cast<Eigen::Index>(k)]));
      }
    }
  }
}

TEST(EncodeFeatures, WithoutRidgesGlbHasANodeWithoutAMesh) {
  const tinygltf::Model model = read(write_ridges_glb(labelled(test::grid(2, 2)), {}));
  EXPECT_EQ(model.nodes.size(), 1U);
  EXPECT_TRUE(model.meshes.empty());
  EXPECT_TRUE(model.buffers.empty());
}

}  // namespace
}  // namespace crease
