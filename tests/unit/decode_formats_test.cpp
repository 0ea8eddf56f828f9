#include <gtest/gtest.h>

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <filesystem>
#include <fstream>

#include "tests/support/meshes.h"
#include "tests/support/server_process.h"
#include "tests/unit/decode_samples.h"

namespace crease::test {
namespace {

std::vector<std::array<Vec3, 3>> corner_positions(const Mesh& mesh) {
  std::vector<std::array<Vec3, 3>> out;
  for (const Triangle& t : mesh.triangles) {
    out.push_back({mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]});
  }
  return out;
}

bool has_coincident_vertices(const Mesh& mesh) {
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (mesh.positions[i] == mesh.positions[j]) return true;
    }
  }
  return false;
}

/// A temporary file.
class TemporaryFile {
 public:
  TemporaryFile(const std::string& name, const std::string& bytes) : path_(folder_.path() / name) {
    std::ofstream(path_, std::ios::binary) << bytes;
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  test::TemporaryFolder folder_;
  std::filesystem::path path_;
};

using OracleMesh = OpenMesh::TriMesh_ArrayKernelT<>;

Mesh flat_copy(const OracleMesh& oracle) {
  Mesh mesh;
  for (const auto vertex : oracle.vertices()) {
    const auto& p = oracle.point(vertex);
    mesh.positions.emplace_back(p[0], p[1], p[2]);
  }
  for (const auto face : oracle.faces()) {
    Triangle triangle{};
    std::size_t k = 0;
    for (const auto vertex : oracle.fv_range(face)) triangle[k++] = static_cast<Index>(vertex.idx());
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

/// Rotates the corners so that the smallest comes first. OpenMesh may start a face at another corner.
Triangle from_smallest(Triangle t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

TEST(DecodeFormats, EveryFormatGivesTheSameMesh) {
  for (const NamedMesh& named : mesh_family()) {
    const Mesh mesh = in_single_precision(named.mesh);
    const bool coincident = has_coincident_vertices(mesh);
    for (const SampleFile& file : sample_files(mesh)) {
      SCOPED_TRACE(named.name + " as " + file.name);
      const DecodedMesh decoded = decode_mesh(file.bytes, file.format);
      EXPECT_EQ(decoded.format, file.format);
      const bool may_weld =
          file.format == MeshFormat::kStl || file.format == MeshFormat::kGltf || file.format == MeshFormat::kGlb;
      if (file.format != MeshFormat::kStl && !(may_weld && coincident)) {
        EXPECT_EQ(decoded.mesh.positions, mesh.positions);
        EXPECT_EQ(decoded.mesh.triangles, mesh.triangles);
        EXPECT_TRUE(decoded.warnings.empty());
      }
      EXPECT_EQ(corner_positions(decoded.mesh), corner_positions(mesh));
      EXPECT_FALSE(may_weld && has_coincident_vertices(decoded.mesh));
    }
  }
}

TEST(DecodeFormats, TextKeepsEveryBitOfADouble) {
  Mesh mesh = connected_sample();
  mesh.positions[1] = {1.0 / 3.0, 6.02214076e23, -4.9406564584124654e-324};
  for (const std::string& file : {obj_file(mesh), off_file(mesh), ply_ascii_file(mesh), stl_ascii_file(mesh)}) {
    EXPECT_EQ(corner_positions(decode_mesh(file, std::nullopt).mesh), corner_positions(mesh));
  }
}

TEST(DecodeFormats, TheFormatIsGuessedFromTheBytes) {
  for (const SampleFile& file : sample_files(sample_mesh())) {
    EXPECT_EQ(decode_mesh(file.bytes, std::nullopt).format, file.format) << file.name;
  }
}

TEST(DecodeFormats, AllLineEndingsAreRead) {
  for (const SampleFile& file : sample_files(sample_mesh())) {
    if (file.bytes.find('\0') != std::string::npos || file.name.find("endian") != std::string::npos) continue;
    for (const std::string line_end : {"\r\n", "\r"}) {
      std::string bytes;
      for (const char c : file.bytes) bytes += c == '\n' ? line_end : std::string(1, c);
      SCOPED_TRACE(file.name);
      const DecodedMesh decoded = decode_mesh(bytes, file.format);
      EXPECT_EQ(corner_positions(decoded.mesh), corner_positions(sample_mesh()));
    }
  }
}

TEST(DecodeFormats, AgreesWithOpenMeshOnValidFiles) {
  omerr().disable();  // it prints a line for every face that it splits
  int compared = 0;
  for (const NamedMesh& named : mesh_family()) {
    if (!named.manifold || named.degenerate) continue;
    const Mesh mesh = in_single_precision(named.mesh);
    for (const SampleFile& file : sample_files(mesh)) {
      if (file.format == MeshFormat::kStl || file.format == MeshFormat::kGltf || file.format == MeshFormat::kGlb) {
        continue;
      }
      SCOPED_TRACE(named.name + " as " + file.name);
      const TemporaryFile on_disk("mesh." + std::string(format_name(file.format)), file.bytes);
      OracleMesh oracle;
      ASSERT_TRUE(OpenMesh::IO::read_mesh(oracle, on_disk.path().string()));
      const Mesh expected = flat_copy(oracle);
      if (expected.positions.size() != mesh.positions.size())
        continue;  // it splits vertices of inconsistently wound faces
      const Mesh decoded = decode_mesh(file.bytes, file.format).mesh;
      EXPECT_EQ(decoded.positions, expected.positions);
      ++compared;
      ASSERT_EQ(decoded.triangles.size(), expected.triangles.size());
      for (std::size_t f = 0; f < decoded.triangles.size(); ++f) {
        EXPECT_EQ(from_smallest(decoded.triangles[f]), from_smallest(expected.triangles[f]));
      }
    }
  }
  omerr().enable();
  EXPECT_GE(compared, 20);
}

TEST(DecodeFormats, AgreesWithOpenMeshOnStl) {
  const Mesh mesh = in_single_precision(icosphere(1));
  for (const std::string& bytes : {stl_ascii_file(mesh), stl_binary_file(mesh)}) {
    const TemporaryFile on_disk("mesh.stl", bytes);
    OracleMesh oracle;
    ASSERT_TRUE(OpenMesh::IO::read_mesh(oracle, on_disk.path().string()));
    const Mesh expected = flat_copy(oracle);
    const Mesh decoded = decode_mesh(bytes, MeshFormat::kStl).mesh;
    EXPECT_EQ(decoded.positions, expected.positions);
    ASSERT_EQ(decoded.triangles.size(), expected.triangles.size());
    for (std::size_t f = 0; f < decoded.triangles.size(); ++f) {
      EXPECT_EQ(from_smallest(decoded.triangles[f]), from_smallest(expected.triangles[f]));
    }
  }
}

TEST(DecodeFormats, AgreesWithOpenMeshOnARealScan) {
  const auto path = development_mesh("Fandisk0.3/noisy.obj");
  if (!path) GTEST_SKIP() << "the development models are not available";
  OracleMesh oracle;
  ASSERT_TRUE(OpenMesh::IO::read_mesh(oracle, path->string()));
  const Mesh expected = flat_copy(oracle);
  const Mesh decoded = in_single_precision(decode_mesh(read_file(*path), MeshFormat::kObj).mesh);
  EXPECT_EQ(decoded.positions, expected.positions);
  ASSERT_EQ(decoded.triangles.size(), expected.triangles.size());
  for (std::size_t f = 0; f < decoded.triangles.size(); ++f) {
    ASSERT_EQ(from_smallest(decoded.triangles[f]), from_smallest(expected.triangles[f]));
  }
}

}  // namespace
}  // namespace crease::test
