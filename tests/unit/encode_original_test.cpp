#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <sstream>

#include "core/error.h"
#include "core/io/encode.h"
#include "core/measure/noise.h"
#include "tests/support/labelled_meshes.h"
#include "tests/support/meshes.h"
#include "tests/unit/decode_samples.h"

namespace crease::test {
namespace {

/// Positions that single precision holds, so that every format can return them exactly.
Mesh moved(const Mesh& mesh) { return in_single_precision(add_noise(mesh, 0.1, 5, NoiseKind::kGaussian)); }

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::string joined_by_blanks(const Vec3& vector) { return fmt::format("{} {} {}", vector.x(), vector.y(), vector.z()); }

TEST(EncodeOriginal, EveryFormatReturnsTheNewPositions) {
  for (const Mesh& mesh : {connected_sample(), cube(3), icosphere(2)}) {
    for (const SampleFile& file : sample_files(in_single_precision(mesh))) {
      SCOPED_TRACE(file.name);
      const DecodedMesh before = decode_mesh(file.bytes, file.format);
      const Mesh after = moved(before.mesh);
      const DecodedMesh read = decode_mesh(encode_original(file.bytes, file.format, labelled(after)), file.format);
      EXPECT_EQ(read.mesh.positions, after.positions);
      EXPECT_EQ(read.mesh.triangles, after.triangles);
    }
  }
}

TEST(EncodeOriginal, WithoutAMoveTheFileStays) {
  for (const SampleFile& file : sample_files(sample_mesh())) {
    if (file.format == MeshFormat::kGlb || file.format == MeshFormat::kGltf) continue;  // their extent is set
    SCOPED_TRACE(file.name);
    const LabelledMesh result = labelled(decode_mesh(file.bytes, file.format).mesh);
    EXPECT_EQ(encode_original(file.bytes, file.format, result), file.bytes);
  }
}

TEST(EncodeOriginal, ObjKeepsAllOtherLines) {
  const std::string text = join({"# a comment", "mtllib part.mtl", "o part", "v 0 0 0 1 0.5 0.25  # red", "v +1 0 0",
                                 "v 0 1 \\", "  0 0.5", "v 0 0 1", "vt 0.5 0.25", "vn 0 0 -1", "vn 1 0 0", "g side",
                                 "usemtl steel", "s 1", "f 1/1/1 3/1/1 2/1/1", "f -4//2 -3//2 -1//2", "l 1 2"},
                                "\r\n");
  LabelledMesh result = labelled(decode_mesh(text, MeshFormat::kObj).mesh);
  for (Vec3& position : result.mesh.positions) position += Vec3(0.125, 0, 3);
  const std::vector<std::string> lines = lines_of(encode_original(text, MeshFormat::kObj, result));
  const std::vector<std::string> expected =
      lines_of(join({"# a comment", "mtllib part.mtl", "o part", "v 0.125 0 3 1 0.5 0.25  # red", "v 1.125 0 3",
                     "v 0.125 1 \\", "  3 0.5", "v 0.125 0 4", "vt 0.5 0.25", "vn 0 0 -1", "vn 0 -1 0", "g side",
                     "usemtl steel", "s 1", "f 1/1/1 3/1/1 2/1/1", "f -4//2 -3//2 -1//2", "l 1 2"},
                    "\r\n"));
  EXPECT_EQ(lines.size(), expected.size());
  for (std::size_t i = 0; i < std::min(lines.size(), expected.size()); ++i) {
    if (expected[i].starts_with("vn")) continue;
    EXPECT_EQ(lines[i], expected[i]);
  }
}

/// An OBJ file whose corners have normals of their own, in one number per face.
TEST(EncodeOriginal, ObjNormalsAreThoseOfTheirFaces) {
  const Mesh mesh = cube(1);
  std::string text;
  for (const Vec3& position : mesh.positions) text += "v " + joined_by_blanks(position) + "\n";
  for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
    const auto& [a, b, c] = mesh.triangles[face];
    text += fmt::format("vn 0 0 0\nf {1}//{0} {2}//{0} {3}//{0}\n", face + 1, a + 1, b + 1, c + 1);
  }
  const LabelledMesh result = labelled(mesh);  // the edges of a cube are ridges
  const std::vector<std::string> lines = lines_of(encode_original(text, MeshFormat::kObj, result));
  std::size_t face = 0;
  for (const std::string& line : lines) {
    if (!line.starts_with("vn")) continue;
    const auto& [a, b, c] = mesh.triangles[face++];
    const Vec3 expected =
        (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]).normalized();
    Vec3 normal;
    std::istringstream(line.substr(2)) >> normal.x() >> normal.y() >> normal.z();
    EXPECT_NEAR((normal - expected).norm(), 0, 1e-12);
  }
  EXPECT_EQ(face, 12U);
}

TEST(EncodeOriginal, OffKeepsColoursAndPolygons) {
  const std::string text = join({"CNOFF", "4 2 0", "0 0 0 0 0 -1 255 0 0 1  # first", "1 0 0 0 0 1 0 255 0 1",
                                 "1 1 0 0 0 1 0 0 255 1", "0 1 0 0 0 1 9 9 9 1", "4 0 1 2 3 0.5 0.5 0.5", "2 0 1"});
  LabelledMesh result = labelled(decode_mesh(text, MeshFormat::kOff).mesh);
  for (Vec3& position : result.mesh.positions) position.z() += 2;
  EXPECT_EQ(encode_original(text, MeshFormat::kOff, result),
            join({"CNOFF", "4 2 0", "0 0 2 0 0 1 255 0 0 1  # first", "1 0 2 0 0 1 0 255 0 1", "1 1 2 0 0 1 0 0 255 1",
                  "0 1 2 0 0 1 9 9 9 1", "4 0 1 2 3 0.5 0.5 0.5", "2 0 1"}));
}

TEST(EncodeOriginal, StlKeepsTextBetweenFacets) {
  const auto file = [](const std::string& z) {
    return "solid a b\nfacet normal 0 0 1 ; up\nouter loop\n# vertex 7 7 7\nvertex 0 0 " + z + "\nvertex 1 0 " + z +
           " (a corner)\nvertex 1 1 " + z + "\nendloop\nendfacet\nEndSolid a b\nvolume: 0\n";
  };
  LabelledMesh result = labelled(decode_mesh(file("0"), MeshFormat::kStl).mesh);
  for (Vec3& position : result.mesh.positions) position.z() += 2;
  EXPECT_EQ(encode_original(file("0"), MeshFormat::kStl, result), file("2"));
}

TEST(EncodeOriginal, OffKeepsItsLines) {
  const std::string text =
      "CNOFF 3 2 0 # several on a line\n0 0 0 0 0 -1 9 9 9 1  1 0 0 0 0 -1 9 9 9 1\n"
      "1 1 0 0 0 -1 9 9 9 1 3 0 1 2 1 0 0 3 2 1 0 0 1 0";
  LabelledMesh result = labelled(decode_mesh(text, MeshFormat::kOff).mesh);
  for (Vec3& position : result.mesh.positions) position.z() += 2;
  const std::string patched = encode_original(text, MeshFormat::kOff, result);
  EXPECT_EQ(patched.find("CNOFF 3 2 0 # several on a line\n0 0 2 "), 0U);
  EXPECT_NE(patched.find(" 9 9 9 1  1 0 2 "), std::string::npos);
  EXPECT_EQ(patched.substr(patched.find("3 0 1 2")), text.substr(text.find("3 0 1 2")));
  EXPECT_EQ(decode_mesh(patched, MeshFormat::kOff).mesh.positions, result.mesh.positions);
}

const std::string kPlyHead =
    "comment by hand\nobj_info 7\nelement camera 1\nproperty list uchar short view\n"
    "element vertex 4\nproperty uchar red\nproperty float x\nproperty double z\nproperty float y\n"
    "property float nx\nproperty float ny\nproperty float nz\nproperty list uchar int tags\n"
    "element face 1\nproperty float nx\nproperty list uchar ushort vertex_indices\nproperty float ny\n"
    "property float nz\nproperty uchar flags\nend_header\n";

/// A square as one polygon, at height `z`, with its normals.
std::string ply_square_ascii(double z, double normal) {
  std::string text = "ply\nformat ascii 1.0\n" + kPlyHead + "2 -1 7\n";
  for (const auto& [x, y] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
    text += fmt::format("200 {} {} {} 0 0 {} 2 5 6\n", x, z, y, normal);
  }
  return text + fmt::format("0 4 0 1 2 3 0 {} 9\n", normal);
}

std::string ply_square_binary(double z, float normal, bool big) {
  std::string bytes = fmt::format("ply\nformat binary_{}_endian 1.0\n", big ? "big" : "little") + kPlyHead;
  append(bytes, std::uint8_t{1});
  append(bytes, std::int16_t{-300}, big);
  for (const auto& [x, y] : {std::pair{0.F, 0.F}, {1.F, 0.F}, {1.F, 1.F}, {0.F, 1.F}}) {
    append(bytes, std::uint8_t{200});
    append(bytes, x, big);
    append(bytes, z, big);
    append(bytes, y, big);
    for (const float coordinate : {0.F, 0.F, normal}) append(bytes, coordinate, big);
    append(bytes, std::uint8_t{1});
    append(bytes, std::int32_t{77}, big);
  }
  append(bytes, 0.F, big);
  append(bytes, std::uint8_t{4});
  for (std::uint16_t corner = 0; corner < 4; ++corner) append(bytes, corner, big);
  append(bytes, 0.F, big);
  append(bytes, normal, big);
  append(bytes, std::uint8_t{9});
  return bytes + "trailing";
}

TEST(EncodeOriginal, PlyKeepsElementsPropertiesTypesAndByteOrder) {
  const auto lifted = [](const std::string& bytes) {
    LabelledMesh result = labelled(decode_mesh(bytes, MeshFormat::kPly).mesh);
    for (Vec3& position : result.mesh.positions) position.z() += 0.1;
    return encode_original(bytes, MeshFormat::kPly, result);
  };
  EXPECT_EQ(lifted(ply_square_ascii(2, -1)), ply_square_ascii(2.1, 1));
  for (const bool big : {false, true}) {
    EXPECT_EQ(lifted(ply_square_binary(2, -1, big)), ply_square_binary(2.1, 1, big)) << big;
  }
}

TEST(EncodeOriginal, PlyWithIntegerCoordinatesIsRefused) {
  const std::string text = join({"ply", "format ascii 1.0", "element vertex 3", "property int x", "property int y",
                                 "property int z", "element face 1", "property list uchar int vertex_indices",
                                 "end_header", "0 0 0", "1 0 0", "0 1 0", "3 0 1 2"});
  const LabelledMesh result = labelled(decode_mesh(text, MeshFormat::kPly).mesh);
  try {
    encode_original(text, MeshFormat::kPly, result);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code::kMeshUnsupported);
    EXPECT_EQ(error.place(), "line 3");
  }
}

std::string stl_triangle(float z, float normal) {
  std::string bytes = "COLOR=abcd";
  bytes.resize(80, '\0');
  append(bytes, std::uint32_t{2});
  for (const float scale : {1.F, 2.F}) {
    append_floats(bytes, scale == 1 ? Vec3(0, 0, normal) : Vec3::Zero());
    for (const Vec3& corner : {Vec3(0, 0, z), Vec3(scale, 0, z), Vec3(0, scale, z)}) append_floats(bytes, corner);
    append(bytes, std::uint16_t{0x801f});
  }
  return bytes + "tail";
}

TEST(EncodeOriginal, StlKeepsHeaderAttributesAndNames) {
  LabelledMesh result = labelled(decode_mesh(stl_triangle(0, -1), MeshFormat::kStl).mesh);
  for (Vec3& position : result.mesh.positions) position.z() = 0.5;
  EXPECT_EQ(encode_original(stl_triangle(0, -1), MeshFormat::kStl, result), stl_triangle(0.5, 1));

  const auto text = [](const std::string& z, int normal) {
    return join({"solid the vertex part", "  facet normal 0 0 " + std::to_string(normal), "    outer loop",
                 "      vertex 0 0 " + z, "      vertex 1 0 " + z, "      vertex 0 1 " + z, "    endloop", "  endfacet",
                 "endsolid the vertex part", "", "solid second", "endsolid second"});
  };
  result = labelled(decode_mesh(text("0", -1), MeshFormat::kStl).mesh);
  for (Vec3& position : result.mesh.positions) position.z() = 0.5;
  EXPECT_EQ(encode_original(text("0", -1), MeshFormat::kStl, result), text("0.5", 1));
}

TEST(EncodeOriginal, AnotherFileIsRefused) {
  for (const SampleFile& file : sample_files(connected_sample())) {
    SCOPED_TRACE(file.name);
    EXPECT_THROW(encode_original(file.bytes, file.format, labelled(icosphere(0))), Error);
    EXPECT_THROW(encode_original(file.bytes, file.format, labelled({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}})),
                 Error);
  }
}

}  // namespace
}  // namespace crease::test
