#include <gtest/gtest.h>

#include "tests/unit/decode_samples.h"

namespace crease::test {
namespace {

const std::vector<Vec3> kSquare{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
const std::vector<Triangle> kSquareFan{{0, 1, 2}, {0, 2, 3}};

DecodedMesh decoded(const std::vector<std::string>& lines, MeshFormat format) {
  return decode_mesh(join(lines), format);
}

TEST(DecodeObj, AllFormsOfCornersAndNegativeIndicesAreRead) {
  for (const std::string face : {"f 1 2 3 4", "f 1/1 2/1 3/1 4/1", "f 1//1 2//1 3//1 4//1", "f 1/1/1 2/1/1 3/1/1 4/1/1",
                                 "f -4 -3 -2 -1", "f -4//-1 2/1 -2 4", "f 1 2 \\\n 3 4", "f 1 2\\\r\n3 4 # square"}) {
    const DecodedMesh result =
        decoded({"v 0 0 0", "v 1 0 0", "v 1 1 0", "v 0 1 0", "vt 0 0", "vn 0 0 1", face}, MeshFormat::kObj);
    EXPECT_EQ(result.mesh.positions, kSquare) << face;
    EXPECT_EQ(result.mesh.triangles, kSquareFan) << face;
    EXPECT_NE(warning(result, "polygons_triangulated"), "") << face;
  }
}

TEST(DecodeObj, WeightsColoursSignsAndExponentsAreRead) {
  const DecodedMesh result =
      decoded({"v +1 -2.5e-1 .5 1.0", "v 1E2 0 0 0.1 0.2 0.3", "\tv 1e-400 -0 5.  ", "f 1 2 3"}, MeshFormat::kObj);
  EXPECT_EQ(result.mesh.positions, (std::vector<Vec3>{{1, -0.25, 0.5}, {100, 0, 0}, {0, 0, 5}}));
  ASSERT_EQ(result.warnings.size(), 1U);
  EXPECT_NE(warning(result, "attributes_dropped").find("colours"), std::string::npos);
}

TEST(DecodeObj, FacesMayPrecedeTheirVertices) {
  const DecodedMesh result = decoded({"f 1 2 3", "v 0 0 0", "v 1 0 0", "v 1 1 0"}, MeshFormat::kObj);
  EXPECT_EQ(result.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
}

TEST(DecodeObj, MaterialsAreNeverOpenedAndSkippedLinesAreCounted) {
  const DecodedMesh result = decoded({"mtllib /etc/passwd", "o part", "g a b", "s off", "usemtl red", "v 0 0 0",
                                      "v 1 0 0", "v 1 1 0", "l 1 2", "l 2 3", "p 1", "curv 0 1", "f 1 2 3", "\x01\xff"},
                                     MeshFormat::kObj);
  EXPECT_EQ(result.mesh.triangles.size(), 1U);
  ASSERT_EQ(result.warnings.size(), 3U);
  EXPECT_NE(warning(result, "elements_skipped").find("2 line elements (l) and 1 point element (p)"), std::string::npos);
  EXPECT_NE(warning(result, "statements_skipped").find("1 'curv', 1 '"), std::string::npos);
  EXPECT_NE(warning(result, "attributes_dropped").find("material names"), std::string::npos);
}

TEST(DecodeObj, StatementsOfFreeFormsAreNamedWithTheirCounts) {
  const std::vector<std::string> free_form{"cstype bspline", "deg 3", "curv 0 1 1 2 3", "parm u 0 1", "end"};
  std::vector<std::string> lines{"v 0 0 0", "v 1 0 0", "v 1 1 0", "f 1 2 3"};
  for (int copy = 0; copy < 3; ++copy) lines.insert(lines.end(), free_form.begin(), free_form.end());
  lines.emplace_back("surf 0 1 0 1 1 2 3");
  const DecodedMesh result = decoded(lines, MeshFormat::kObj);
  EXPECT_EQ(warning(result, "statements_skipped"),
            "skipped statements that are not read: 3 'cstype', 3 'deg', 3 'curv', 3 'parm', 3 'end', 1 'surf'");
  EXPECT_EQ(warning(result, "elements_skipped"), "");
}

TEST(DecodeObj, AThousandKindsOfStatementsMakeAShortWarning) {
  std::vector<std::string> lines{"v 0 0 0", "v 1 0 0", "v 1 1 0", "f 1 2 3"};
  for (int kind = 0; kind < 1000; ++kind) lines.push_back(fmt::format("kind{} 1", kind));
  const std::string detail = warning(decoded(lines, MeshFormat::kObj), "statements_skipped");
  EXPECT_NE(detail.find("1 'kind19', 980 of further kinds"), std::string::npos) << detail;
}

TEST(DecodeObj, DegenerateAndDuplicateFacesAndIsolatedVerticesAreKept) {
  const DecodedMesh result =
      decoded({"v 0 0 0", "v 1 0 0", "v 1 1 0", "v 9 9 9", "f 1 1 2", "f 1 2 3", "f 1 2 3"}, MeshFormat::kObj);
  EXPECT_EQ(result.mesh.positions.size(), 4U);
  EXPECT_EQ(result.mesh.triangles, (std::vector<Triangle>{{0, 0, 1}, {0, 1, 2}, {0, 1, 2}}));
}

TEST(DecodeOff, CountsOnTheFirstLineCommentsAndColoursAreRead) {
  const std::vector<std::string> body{"0 0 0 ", "# a comment", "1 0 0 # another",  "",
                                      "1 1 0",  "0 1 0",       "4 0 1 2 3 255 0 0"};
  for (const std::vector<std::string>& head :
       {std::vector<std::string>{"OFF 4 1 0"}, {"OFF", "4 1 0"}, {"OFF", "# c", "", "4 1"}, {"4 1 0"}}) {
    const DecodedMesh result = decode_mesh(join(head) + join(body), MeshFormat::kOff);
    EXPECT_EQ(result.mesh.positions, kSquare);
    EXPECT_EQ(result.mesh.triangles, kSquareFan);
    EXPECT_EQ(warning(result, "polygons_triangulated"), "1 face of more than 3 corners became 2 triangles");
  }
}

TEST(DecodeOff, ExtraColumnsOfVerticesAreSkipped) {
  for (const std::string keyword : {"COFF", "NOFF", "CNOFF", "STOFF", "STCNOFF"}) {
    const DecodedMesh result =
        decoded({keyword, "3 1 0", "0 0 0 0 0 1 255 255 255 255 0.5 0.5", "1 0 0 0 0 1 255 255 255 255 0.5 0.5",
                 "1 1 0 0 0 1 255 255 255 255 0.5 0.5", "3 0 1 2"},
                MeshFormat::kOff);
    EXPECT_EQ(result.mesh.positions.back(), Vec3(1, 1, 0)) << keyword;
  }
}

TEST(DecodeOff, TextAfterTheLastFaceIsReported) {
  EXPECT_NE(warning(decode_mesh(off_file(sample_mesh()) + "1 2\n", MeshFormat::kOff), "trailing_bytes"), "");
  EXPECT_TRUE(decode_mesh(off_file(sample_mesh()) + "\n# end\n", MeshFormat::kOff).warnings.empty());
}

TEST(DecodePly, ExtraPropertiesElementsAndOrdersAreSkipped) {
  const DecodedMesh result = decoded({"ply",
                                      "format ascii 1.0",
                                      "comment made by hand",
                                      "obj_info none",
                                      "element camera 1",
                                      "property list uchar int ids",
                                      "property float f",
                                      "element face 2",
                                      "property uchar red",
                                      "property list uint short vertex_index",
                                      "property list uchar float texcoord",
                                      "element vertex 4",
                                      "property double z",
                                      "property uchar flags",
                                      "property double y",
                                      "property list uchar int rings",
                                      "property double x",
                                      "element edge 0",
                                      "property int vertex1",
                                      "end_header",
                                      "2 5 6 0.5",
                                      "9 4 0 1 2 3 2 0.5 0.5",
                                      "9 3 3 2 1 0",
                                      "0 1 0 0 0",
                                      "0 1 0 1 7 1",
                                      "0 1 1 0 1",
                                      "0 1 1 2 7 8 0"},
                                     MeshFormat::kPly);
  EXPECT_EQ(result.mesh.positions, kSquare);
  EXPECT_EQ(result.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {3, 2, 1}}));
}

template <typename X, typename Y, typename Z, typename Count, typename Item>
void expect_binary_types(const std::array<std::string, 5>& names, bool big) {
  std::string bytes =
      join({"ply", std::string("format binary_") + (big ? "big" : "little") + "_endian 1.0", "element vertex 3",
            "property uchar a", "property " + names[0] + " x", "property " + names[1] + " y",
            "property list uchar double skipped", "property " + names[2] + " z", "element face 1",
            "property double weight", "property list " + names[3] + " " + names[4] + " vertex_indices", "end_header"});
  for (int i = 0; i < 3; ++i) {
    append(bytes, std::uint8_t{200});
    append(bytes, static_cast<X>(i), big);
    append(bytes, static_cast<Y>(2 * i), big);
    append(bytes, static_cast<std::uint8_t>(i));
    for (int k = 0; k < i; ++k) append(bytes, 0.5, big);
    append(bytes, static_cast<Z>(100 + i), big);
  }
  append(bytes, 0.25, big);
  append(bytes, static_cast<Count>(3), big);
  for (int k = 0; k < 3; ++k) append(bytes, static_cast<Item>(2 - k), big);
  const DecodedMesh result = decode_mesh(bytes, MeshFormat::kPly);
  EXPECT_EQ(result.mesh.positions, (std::vector<Vec3>{{0, 0, 100}, {1, 2, 101}, {2, 4, 102}}));
  EXPECT_EQ(result.mesh.triangles, (std::vector<Triangle>{{2, 1, 0}}));
  ASSERT_EQ(result.warnings.size(), 1U);
  const std::string dropped = warning(result, "attributes_dropped");
  for (const char* name : {"vertex property a", "vertex property skipped", "face property weight"})
    EXPECT_NE(dropped.find(name), std::string::npos) << dropped;
}

TEST(DecodePly, ScalarsOfEveryTypeAndByteOrderAreRead) {
  for (const bool big : {false, true}) {
    expect_binary_types<std::int8_t, std::uint8_t, std::int16_t, std::uint16_t, std::uint8_t>(
        {"char", "uint8", "short", "ushort", "uchar"}, big);
    expect_binary_types<std::uint16_t, std::int32_t, std::uint32_t, std::int8_t, std::int16_t>(
        {"uint16", "int", "uint32", "int8", "int16"}, big);
    expect_binary_types<float, double, float, std::int32_t, std::int32_t>(
        {"float32", "float64", "float", "int32", "int"}, big);
  }
}

TEST(DecodePly, ABinaryBodyMayStartWithALineFeed) {
  std::string bytes = ply_binary_file(sample_mesh(), false);
  const std::size_t body = bytes.find("end_header\n") + 11;
  bytes[body] = '\n';
  const Vec3 first = decode_mesh(bytes, MeshFormat::kPly).mesh.positions[0];
  for (const std::string line_end : {"\r", "\r\n"}) {
    std::string head;
    for (const char c : bytes.substr(0, body)) head += c == '\n' ? line_end : std::string(1, c);
    EXPECT_EQ(decode_mesh(head + bytes.substr(body), MeshFormat::kPly).mesh.positions[0], first);
  }
}

TEST(DecodePly, BytesAfterTheLastElementAreReported) {
  for (const std::string& bytes : {ply_ascii_file(sample_mesh()), ply_binary_file(sample_mesh(), true)}) {
    EXPECT_NE(warning(decode_mesh(bytes + "tail", MeshFormat::kPly), "trailing_bytes"), "");
  }
}

TEST(DecodeStl, CornersAreWeldedByExactPositionInTheOrderOfTheFacets) {
  for (const std::string& bytes : {stl_ascii_file(connected_sample()), stl_binary_file(connected_sample())}) {
    const DecodedMesh result = decode_mesh(bytes, MeshFormat::kStl);
    const std::vector<Vec3>& p = sample_mesh().positions;
    EXPECT_EQ(result.mesh.positions, (std::vector<Vec3>{p[0], p[2], p[1], p[3]}));
    EXPECT_EQ(result.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {2, 1, 3}}));
    EXPECT_EQ(warning(result, "stl_vertices_welded"),
              "welded 9 facet corners with exactly equal positions to 4 vertices");
  }
}

TEST(DecodeStl, PositiveAndNegativeZeroAreEqual) {
  const Mesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-0.0, -0.0, -0.0}}, {{0, 1, 2}, {3, 2, 1}}};
  EXPECT_EQ(decode_mesh(stl_binary_file(mesh), MeshFormat::kStl).mesh.positions.size(), 3U);
  EXPECT_EQ(decode_mesh(stl_ascii_file(mesh), MeshFormat::kStl).mesh.positions.size(), 3U);
}

TEST(DecodeStl, ABinaryFileMayStartWithSolid) {
  const std::string bytes = stl_binary_file(connected_sample(), "solid part");
  EXPECT_EQ(decode_mesh(bytes, MeshFormat::kStl).mesh.triangles.size(), 3U);
  const DecodedMesh with_tail = decode_mesh(bytes + "tail", MeshFormat::kStl);
  EXPECT_EQ(with_tail.mesh.triangles.size(), 3U);
  EXPECT_NE(warning(with_tail, "trailing_bytes"), "");
  EXPECT_EQ(refusal(bytes.substr(0, bytes.size() - 1), MeshFormat::kStl)->code(), code::kMeshTruncated);
}

TEST(DecodeStl, SeveralSolidsUpperCaseAndInvalidNormalsAreRead) {
  const std::string facet =
      "FACET NORMAL nan nan nan OUTER LOOP\nVERTEX 0 0 0 VERTEX 1 0 0\nVERTEX 1 1 0 ENDLOOP ENDFACET\n";
  const DecodedMesh result =
      decode_mesh("SOLID a\n" + facet + "ENDSOLID a\nsolid b\n" + facet + "endsolid", MeshFormat::kStl);
  EXPECT_EQ(result.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 1, 2}}));
}

TEST(Decode, LimitsApplyToEveryFormat) {
  for (const SampleFile& file : sample_files(connected_sample())) {
    SCOPED_TRACE(file.name);
    EXPECT_FALSE(refusal(file.bytes, file.format, {4, 3}).has_value());
    const auto vertices = refusal(file.bytes, file.format, {3, 3});
    ASSERT_TRUE(vertices.has_value());
    EXPECT_EQ(vertices->code(), code::kMeshTooLarge);
    const auto faces = refusal(file.bytes, file.format, {4, 2});
    ASSERT_TRUE(faces.has_value());
    EXPECT_EQ(faces->code(), code::kMeshTooLarge);
  }
}

}  // namespace
}  // namespace crease::test
