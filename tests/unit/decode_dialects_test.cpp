#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/encode.h"
#include "core/mesh/face_vectors.h"
#include "tests/support/labelled_meshes.h"
#include "tests/support/meshes.h"
#include "tests/unit/decode_samples.h"

namespace crease::test {
namespace {

using testing::HasSubstr;

/// A cube of 8 vertices and 12 faces with simple coordinates that single precision holds.
Mesh box() {
  return {{{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}, {1, 0, 0}, {1, 1, 0}, {1, 1, 1}, {1, 0, 1}},
          {{3, 2, 1},
           {3, 1, 0},
           {4, 5, 6},
           {4, 6, 7},
           {4, 7, 3},
           {4, 3, 0},
           {1, 2, 6},
           {1, 6, 5},
           {1, 5, 4},
           {1, 4, 0},
           {7, 6, 2},
           {7, 2, 3}}};
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string with_blanks_as_line_ends(std::string text) {
  std::replace(text.begin(), text.end(), ' ', '\n');
  return text;
}

std::string body_of_ply(const std::string& file) { return file.substr(file.find("end_header\n") + 11); }

/// The box as strips: each face one, then a real strip.
std::string ply_of_strips(const std::string& list) {
  std::string header =
      join({"ply", "format ascii 1.0", "element vertex 8", "property float x", "property float y", "property float z",
            "element tristrips 1", "property list int int vertex_indices", "end_header"});
  for (const Vec3& p : box().positions) header += xyz(p) + "\n";
  return header + list + "\n";
}

std::string strips_of_single_faces() {
  std::string list = "48";
  for (const auto& [a, b, c] : box().triangles) list += fmt::format(" {} {} {} -1", a, b, c);
  return ply_of_strips(list);
}

std::string off_body() { return off_file(box()).substr(4); }

std::string on_one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

/// OFF files of the box with several vertices or faces on a line, with these columns behind them.
SampleFile wide_off(const std::string& name, const std::string& keyword, const std::string& behind_vertices,
                    const std::string& behind_faces, std::size_t per_line) {
  std::string text = keyword + "\n8 12 0\n";
  std::size_t count = 0;
  const auto end = [&] { return ++count % per_line == 0 ? " # a comment\n" : "  "; };
  for (const Vec3& p : box().positions) text += xyz(p) + behind_vertices + end();
  for (const auto& [a, b, c] : box().triangles) text += fmt::format("3 {} {} {}{}", a, b, c, behind_faces) + end();
  return {name, MeshFormat::kOff, text};
}

std::vector<SampleFile> wide_off_dialects() {
  return {wide_off("off_two_a_line", "OFF", "", "", 2),
          wide_off("off_seven_a_line", "OFF", "", "", 7),
          wide_off("off_two_a_line_with_colours", "COFF", " 1 0 0 1", " 1 0 0", 2),
          wide_off("off_three_a_line_with_colours_of_three", "COFF", " 1 0 0", "", 3),
          wide_off("off_two_a_line_with_unannounced_colours", "OFF", " 255 0 0", " 0 9 8 255", 2),
          wide_off("off_five_a_line_with_normals", "NOFF", " 0 0 1", " 7", 5),
          wide_off("off_all_on_one_line", "OFF", "", "", 99),
          wide_off("off_all_on_one_line_with_all", "STCNOFF", " 0 0 1 9 9 9 9 0.5 0.5", " 255 0 0", 99)};
}

std::vector<SampleFile> dialects() {
  const Mesh mesh = box();
  const std::string ply = ply_ascii_file(mesh), stl = stl_binary_file(mesh);
  std::string vertices, faces;
  for (const Vec3& p : mesh.positions) vertices += xyz(p) + "\n";
  for (const auto& [a, b, c] : mesh.triangles) faces += fmt::format("3 {} {} {}\n", a, b, c);
  std::vector<SampleFile> files{
      {"off_joined_count", MeshFormat::kOff, "OFF8 12 0\n" + vertices + faces},
      {"off_lower_case", MeshFormat::kOff, "off\n" + off_body()},
      {"off_lower_case_joined", MeshFormat::kOff, "off8 12 0\n" + vertices + faces},
      {"off_counts_on_three_lines", MeshFormat::kOff, "OFF\n8\n12\n0\n" + vertices + faces},
      {"off_counts_on_two_lines", MeshFormat::kOff, "OFF 8\n12 0\n" + vertices + faces},
      {"off_edge_count_alone", MeshFormat::kOff, "OFF\n8 12\n0\n" + vertices + faces},
      {"off_without_edge_count", MeshFormat::kOff, "OFF\n8 12\n" + vertices + faces},
      {"off_vertices_over_lines", MeshFormat::kOff, "OFF\n8 12 0\n" + with_blanks_as_line_ends(vertices) + faces},
      {"ply_elements_over_lines", MeshFormat::kPly,
       replaced(ply, body_of_ply(ply), with_blanks_as_line_ends(body_of_ply(ply)))},
      {"ply_strips", MeshFormat::kPly, strips_of_single_faces()},
      {"obj_faces_of_two", MeshFormat::kObj, replaced(obj_file(mesh), "f ", "f 1 2\nf 3\nf ")},
      {"stl_count_of_0", MeshFormat::kStl, stl.substr(0, 80) + std::string(4, '\0') + stl.substr(84)},
      {"stl_byte_order_mark", MeshFormat::kStl, "\xef\xbb\xbf" + stl_ascii_file(mesh)},
      {"obj_byte_order_mark", MeshFormat::kObj, "\xef\xbb\xbf" + obj_file(mesh)},
      {"off_faces_over_lines", MeshFormat::kOff, "OFF\n8 12 0\n" + vertices + with_blanks_as_line_ends(faces)},
      {"off_without_line_ends", MeshFormat::kOff, on_one_line(off_file(mesh))},
      {"off_counts_and_vertices_on_a_line", MeshFormat::kOff, "OFF 8 12 0 " + on_one_line(vertices) + "\n" + faces},
  };
  for (const SampleFile& file : wide_off_dialects()) files.push_back(file);
  return files;
}

class DecodeDialect : public testing::TestWithParam<SampleFile> {};

TEST_P(DecodeDialect, GivesTheSameMeshWithAndWithoutItsFormatsName) {
  for (const auto& format : {std::optional<MeshFormat>(GetParam().format), std::optional<MeshFormat>()}) {
    const DecodedMesh decoded = decode_mesh(GetParam().bytes, format);
    EXPECT_EQ(decoded.format, GetParam().format);
    if (GetParam().format == MeshFormat::kStl) {
      Mesh expected = box();
      ASSERT_EQ(decoded.mesh.triangles.size(), expected.triangles.size());
      for (std::size_t f = 0; f < expected.triangles.size(); ++f) {
        for (std::size_t k = 0; k < 3; ++k) {
          EXPECT_EQ(decoded.mesh.positions[decoded.mesh.triangles[f][k]], expected.positions[expected.triangles[f][k]]);
        }
      }
    } else {
      EXPECT_EQ(decoded.mesh.positions, box().positions);
      EXPECT_EQ(decoded.mesh.triangles, box().triangles);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Table, DecodeDialect, testing::ValuesIn(dialects()),
                         [](const auto& parameter) { return parameter.param.name; });

TEST(DecodeOff, ColoursOfSeveralFacesOnALineAreTheirs) {
  const std::string lines = join({"OFF", "4 4 0", "0 0 0", "1 0 0", "0 1 0", "0 0 1", "3 0 2 1 1 0 0", "3 0 1 3 0 1 0",
                                  "3 1 2 3 0 0 1", "3 0 3 2 0.5 0.5 0.5"});
  const DecodedMesh expected = decode_mesh(lines, MeshFormat::kOff);
  ASSERT_EQ(expected.appearance.face_colours.size(), 4U);
  const DecodedMesh found = decode_mesh(on_one_line(lines), MeshFormat::kOff);
  EXPECT_EQ(found.appearance.face_colours, expected.appearance.face_colours);
}

TEST(DecodeOff, AFaceWithAColourIsNotTakenForTwo) {
  const DecodedMesh decoded =
      decode_mesh(join({"OFF", "4 2 0", "0 0 0", "1 0 0", "1 1 0", "0 1 0", "3 0 1 2 3 2 1 0", "3 0 2 3 3 0 1 2"}),
                  MeshFormat::kOff);
  EXPECT_EQ(decoded.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(decoded.appearance.face_colours.size(), 2U);
}

TEST(DecodeOff, FaultsOnOneLineAreThemselves) {
  const std::string text = on_one_line(off_file(box()));
  EXPECT_EQ(refusal(text.substr(0, text.size() - 3))->code(), code::kMeshTruncated);
  EXPECT_EQ(refusal(replaced(text, "3 3 2 1", "3 3 2 8"))->code(), code::kMeshIndexOutOfRange);
  EXPECT_EQ(refusal(replaced(text, "0 0 0", "0 nan 0"))->code(), code::kMeshNotFinite);
}

/// Counted by words, such a file once made a mesh of numbers that are none of its vertices.
TEST(DecodeOff, WrongCountsOfFilesWithLinesAreRefused) {
  for (const Mesh& mesh : {box(), test::cube(2), test::icosphere(1)}) {
    const std::string text = off_file(mesh), body = text.substr(text.find('\n', 4));
    for (const int more_vertices : {-2, -1, 1, 2, 3}) {
      const std::string head =
          fmt::format("OFF\n{} {} 0", static_cast<int>(mesh.positions.size()) + more_vertices, mesh.triangles.size());
      EXPECT_TRUE(refusal(head + body, MeshFormat::kOff)) << head;
    }
    const std::string head = fmt::format("OFF\n{} {} 0", mesh.positions.size(), mesh.triangles.size() + 1);
    EXPECT_TRUE(refusal(head + body, MeshFormat::kOff)) << head;
  }
}

TEST(DecodePly, StripsAlternateAndSkipTheTrianglesThatOnlyConnect) {
  const DecodedMesh decoded = decode_mesh(ply_of_strips("11 0 1 2 3 3 4 5 -1 6 7 0"), MeshFormat::kPly);
  EXPECT_EQ(decoded.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {2, 1, 3}, {3, 4, 5}, {6, 7, 0}}));
  EXPECT_EQ(refusal(ply_of_strips("4 0 1 2 8"))->code(), code::kMeshIndexOutOfRange);
}

TEST(DecodePly, FacesOfFewCornersAreSkippedInTextAndBinary) {
  const Mesh mesh = sample_mesh();
  for (const bool big_endian : {false, true}) {
    std::string header = ply_header(mesh, big_endian ? "binary_big_endian" : "binary_little_endian");
    std::string bytes = replaced(header, "element face 3", "element face 50");
    for (const Vec3& p : mesh.positions) append_floats(bytes, p, big_endian);
    for (int empty = 0; empty < 47; ++empty) append(bytes, std::uint8_t{0});
    for (const Triangle& t : mesh.triangles) {
      append(bytes, std::uint8_t{3});
      for (const Index corner : t) append(bytes, corner, big_endian);
    }
    const DecodedMesh decoded = decode_mesh(bytes, MeshFormat::kPly);
    EXPECT_EQ(decoded.mesh.triangles, mesh.triangles);
    EXPECT_THAT(warning(decoded, "faces_skipped"), HasSubstr("skipped 47 faces of fewer than 3 corners"));
  }
  const std::string text = replaced(ply_ascii_file(mesh), "element face 3", "element face 6") + "0\n1 2\n2 0 1\n";
  EXPECT_EQ(decode_mesh(text, MeshFormat::kPly).mesh.triangles, mesh.triangles);
}

TEST(DecodePly, WeightsThatLookUnlikeOursAreReported) {
  const auto with_weights = [](const std::string& type, const std::vector<std::string>& weights) {
    std::string file = join({"ply", "format ascii 1.0", "element vertex 3", "property float x", "property float y",
                             "property float z", "property " + type + " weight", "element face 1",
                             "property list uchar int vertex_indices", "end_header"});
    file += "0 0 0 " + weights[0] + "\n1 0 0 " + weights[1] + "\n1 1 0 " + weights[2] + "\n3 0 1 2\n";
    return warning(decode_mesh(file, MeshFormat::kPly), "weights_unusual");
  };
  EXPECT_THAT(with_weights("uchar", {"0", "255", "17"}), HasSubstr("from 0 to 255"));
  EXPECT_THAT(with_weights("float", {"0", "0", "0"}), HasSubstr("from 0 to 0"));
  EXPECT_EQ(with_weights("float", {"0.5", "1", "2"}), "");
}

TEST(DecodeObj, SkippedFacesAreReportedWithTheirPlace) {
  const DecodedMesh decoded = decode_mesh(replaced(obj_file(sample_mesh()), "f ", "f 1 2\nf "), MeshFormat::kObj);
  EXPECT_THAT(warning(decoded, "faces_skipped"), HasSubstr("the first is at line 7"));
}

/// Two solids of the facets of the box, with text around them.
std::string stl_with_text() {
  const std::string text = stl_ascii_file(box());
  const std::string facets = text.substr(text.find("  facet"), text.find("endsolid") - text.find("  facet"));
  const std::size_t half = facets.find("  facet", facets.size() / 2);
  return "Exported on 2024 01 02\n\nSOLID\tpart of a vertex editor\n" + facets.substr(0, half) +
         "\n  the second half, vertex by vertex\n" + "ENDSOLID part of a vertex editor\n\nunits: mm\n\n" +
         "solid facet loop\n# facet normal 0 0 0\n" + facets.substr(half) + "end solid\n\n\x1a";
}

TEST(DecodeStl, TextBetweenFacetsIsSkippedWithAWarning) {
  for (const char* line_end : {"\n", "\r\n", "\r"}) {
    std::string text;
    for (const char c : stl_with_text()) text += c == '\n' ? line_end : std::string(1, c);
    const DecodedMesh decoded = decode_mesh(text, MeshFormat::kStl);
    EXPECT_EQ(decoded.mesh.triangles, decode_mesh(stl_ascii_file(box()), MeshFormat::kStl).mesh.triangles);
    EXPECT_EQ(decoded.mesh.positions, decode_mesh(stl_ascii_file(box()), MeshFormat::kStl).mesh.positions);
    EXPECT_EQ(warning(decoded, "text_skipped"),
              "skipped text that is no part of a facet on 5 lines; the first is line 1: 'Exported on 2024 01 02'");
    EXPECT_EQ(warning(decoded, "endsolid_missing"), "");
    EXPECT_EQ(decode_mesh(text, std::nullopt).mesh.triangles, decoded.mesh.triangles) << "without its format's name";
  }
}

TEST(DecodeStl, ACountOf0IsReported) {
  const std::string stl = stl_binary_file(box());
  const DecodedMesh decoded = decode_mesh(stl.substr(0, 80) + std::string(4, '\0') + stl.substr(84), MeshFormat::kStl);
  EXPECT_THAT(warning(decoded, "facet_count_replaced"), HasSubstr("read the 12"));
}

std::string with_facet_count(std::string stl, char count) { return stl.replace(80, 1, 1, count); }

TEST(DecodeStl, FacetsBehindTheCountAreReadAndPatched) {
  const std::string whole = stl_binary_file(box()), few = with_facet_count(whole, 5);
  const DecodedMesh decoded = decode_mesh(few, MeshFormat::kStl);
  EXPECT_EQ(decoded.mesh.triangles, decode_mesh(whole, MeshFormat::kStl).mesh.triangles);
  EXPECT_THAT(warning(decoded, "facet_count_replaced"), HasSubstr("5 facets; read the 12"));
  EXPECT_EQ(encode_original(few, MeshFormat::kStl, labelled(decoded.mesh)).substr(84), whole.substr(84));
}

TEST(DecodeStl, OtherBytesBehindTheFacetsAreNoFacets) {
  for (const std::string& rest : {std::string(50, '\0'), std::string(100, 'x'), std::string(7, 'x')}) {
    const DecodedMesh decoded = decode_mesh(stl_binary_file(box()) + rest, MeshFormat::kStl);
    EXPECT_EQ(decoded.mesh.triangles.size(), 12U);
    EXPECT_THAT(warning(decoded, "trailing_bytes"), HasSubstr(std::to_string(rest.size())));
  }
}

TEST(DecodeStl, AMissingEndIsReported) {
  std::string text = stl_ascii_file(box());
  text.resize(text.rfind("endsolid"));
  const DecodedMesh decoded = decode_mesh(text, MeshFormat::kStl);
  EXPECT_EQ(decoded.mesh.triangles.size(), 12U);
  EXPECT_THAT(warning(decoded, "endsolid_missing"), HasSubstr("may have been cut off"));
  text.resize(text.rfind("endfacet"));
  EXPECT_EQ(refusal(text, MeshFormat::kStl)->code(), code::kMeshTruncated);
}

TEST(DecodeObj, FourthCoordinatesAreReportedUnlessTheyAreOne) {
  const auto with_fourth = [](const std::string& w) {
    return warning(decode_mesh(join({"v 0 0 0 1", "v 2 0 0 " + w, "v 0 2 0", "f 1 2 3"}), MeshFormat::kObj),
                   "fourth_coordinates_ignored");
  };
  EXPECT_EQ(with_fourth("1.0"), "");
  EXPECT_THAT(with_fourth("2"), HasSubstr("1 vertex has"));
}

TEST(DecodeMesh, FilesOfOtherKindsAreNamed) {
  const std::vector<std::pair<std::string, std::string>> files{{"\x89PNG\r\n", "a PNG picture"},
                                                               {"PK\x03\x04", "3MF"},
                                                               {"\x1f\x8b", "gzip"},
                                                               {"<!DOCTYPE html><p>404", "an HTML page"},
                                                               {"ISO-10303-21;", "STEP"}};
  for (const auto& [start, kind] : files) {
    for (const std::optional<MeshFormat> declared : {std::optional<MeshFormat>(), std::optional(MeshFormat::kObj)}) {
      const std::optional<Error> error = refusal(start + std::string(200, 'x'), declared);
      ASSERT_TRUE(error.has_value()) << kind;
      EXPECT_EQ(error->code(), code::kMeshFormatUnknown) << kind;
      EXPECT_THAT(error->detail(), HasSubstr(kind));
    }
  }
}

TEST(DecodeStl, AnotherFormatsTextUnderItsNameIsRecognised) {
  for (const SampleFile& file : sample_files(sample_mesh())) {
    if (file.format == MeshFormat::kStl) continue;
    const std::optional<Error> error = refusal(file.bytes, MeshFormat::kStl);
    ASSERT_TRUE(error.has_value()) << file.name;
    EXPECT_NE(error->code(), code::kMeshTooLarge) << file.name;
    if (file.name == "obj" || file.name == "off" || file.name == "ply_ascii" || file.name == "gltf") {
      EXPECT_THAT(error->detail(), HasSubstr("look like " + std::string(format_name(file.format)))) << file.name;
    }
  }
}

TEST(Decode, TextInWideEncodingsIsNamed) {
  for (const SampleFile& file : sample_files(sample_mesh())) {
    if (file.bytes.find('\0') != std::string::npos) continue;
    SCOPED_TRACE(file.name);
    std::string little, big, wide = std::string("\xff\xfe\0\0", 4);
    for (const char c : file.bytes) {
      little += {c, '\0'};
      big += {'\0', c};
      wide += {c, '\0', '\0', '\0'};
    }
    for (const std::string& bytes : {little, big, "\xff\xfe" + little, "\xfe\xff" + big}) {
      for (const auto& format : {std::optional<MeshFormat>(), std::optional<MeshFormat>(file.format),
                                 std::optional<MeshFormat>(MeshFormat::kStl)}) {
        const std::optional<Error> error = refusal(bytes, format);
        ASSERT_TRUE(error.has_value());
        EXPECT_THAT(error->detail(), HasSubstr("UTF-16"));
      }
    }
    EXPECT_THAT(refusal(wide)->detail(), HasSubstr("UTF-32"));
  }
}

double area(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& triangle : mesh.triangles) sum += area_vector(mesh.positions, triangle).norm() / 2;
  return sum;
}

/// The corners of a U with area 7, and a face over them from the corner `start` on.
std::vector<std::string> letter(std::size_t start, double bend = 0) {
  std::vector<std::string> lines = {"v 0 0 0", fmt::format("v 3 0 {}", bend),
                                    "v 3 3 0", fmt::format("v 2 3 {}", bend),
                                    "v 2 1 0", "v 1 1 0",
                                    "v 1 3 0", "v 0 3 0"};
  std::string face = "f";
  for (std::size_t k = 0; k < 8; ++k) face += fmt::format(" {}", (start + k) % 8 + 1);
  lines.push_back(face);
  return lines;
}

TEST(DecodePolygons, ConcavePolygonsAreTiledWhereverTheyStart) {
  for (std::size_t start = 0; start < 8; ++start) {
    const DecodedMesh decoded = decode_mesh(join(letter(start)), MeshFormat::kObj);
    ASSERT_EQ(decoded.mesh.triangles.size(), 6U);
    EXPECT_DOUBLE_EQ(area(decoded.mesh), 7) << start;
    for (const Triangle& triangle : decoded.mesh.triangles) {
      EXPECT_GT(area_vector(decoded.mesh.positions, triangle).z(), 0) << start;
    }
    EXPECT_EQ(warning(decoded, "polygons_not_tiled"), "");
    const DecodedMesh bent = decode_mesh(join(letter(start, 0.05)), MeshFormat::kObj);
    EXPECT_NEAR(area(bent.mesh), 7, 0.05) << start;
  }
}

TEST(DecodePolygons, CollinearCornersMakeNoFacesWithoutArea) {
  const DecodedMesh decoded =
      decode_mesh(join({"v 0 0 0", "v 1 0 0", "v 2 0 0", "v 2 2 0", "v 0 2 0", "f 1 2 3 4 5"}), MeshFormat::kObj);
  ASSERT_EQ(decoded.mesh.triangles.size(), 3U);
  for (const Triangle& triangle : decoded.mesh.triangles) {
    EXPECT_GT(area_vector(decoded.mesh.positions, triangle).z(), 0);
  }
}

/// Lines of an OBJ file with one polygon, its corners given from `start` on.
std::vector<std::string> polygon(const std::vector<Vec3>& corners, std::size_t start) {
  std::vector<std::string> lines;
  std::string face = "f";
  for (std::size_t k = 0; k < corners.size(); ++k) {
    lines.push_back(fmt::format("v {} {} {}", corners[k].x(), corners[k].y(), corners[k].z()));
    face += fmt::format(" {}", (start + k) % corners.size() + 1);
  }
  lines.push_back(face);
  return lines;
}

TEST(DecodePolygons, CollinearCornersLeaveNoCracks) {
  const std::vector<Vec3> square{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0},
                                 {2, 2, 0}, {1, 2, 0}, {0, 2, 0}, {0, 1, 0}};
  const std::vector<Vec3> u{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {3, 2, 0}, {3, 3, 0}, {2, 3, 0}, {2, 2, 0},
                            {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {1, 3, 0}, {0, 3, 0}, {0, 2, 0}, {0, 1, 0}};
  for (const Vec3& away : {Vec3(0, 0, 0), Vec3(451234.1, 5412345.7, 312.3)}) {
    for (std::vector<Vec3> corners : {square, u}) {
      const double expected = corners.size() == square.size() ? 4 : 7;
      for (Vec3& corner : corners) corner += away;
      for (std::size_t start = 0; start < corners.size(); ++start) {
        const DecodedMesh decoded = decode_mesh(join(polygon(corners, start)), MeshFormat::kObj);
        EXPECT_NEAR(area(decoded.mesh), expected, 1e-6) << start;
        for (const Triangle& triangle : decoded.mesh.triangles) {
          EXPECT_GT(area_vector(decoded.mesh.positions, triangle).z(), 0.1) << start;
        }
      }
    }
  }
}

TEST(DecodePolygons, ACombOfThousandsOfCornersIsTiled) {
  std::vector<Vec3> corners{{0, -1, 0}};
  constexpr int kTeeth = 600;
  for (int k = 0; k < kTeeth; ++k)
    corners.insert(corners.end(), {{k + 0.5, 0, 0}, {k + 0.5, 5, 0}, {k + 0.9, 5, 0}, {k + 0.9, 0, 0}});
  corners.insert(corners.end(), {{kTeeth, 0, 0}, {kTeeth, -1, 0}});
  std::ranges::reverse(corners);
  const DecodedMesh decoded = decode_mesh(join(polygon(corners, 0)), MeshFormat::kObj);
  const double left = 0.5 * 0.5;  // between the first corner and the first tooth
  EXPECT_NEAR(area(decoded.mesh), kTeeth * (1 + 0.4 * 5) - left, 1e-6);
  EXPECT_EQ(warning(decoded, "polygons_not_tiled"), "");
}

TEST(DecodePolygons, ATriangleThatNamesACornerTwiceIsNoPolygonThatCrossesItself) {
  for (const std::string face : {"f 1 2 3 1", "f 1 1 2 3", "f 1 2 2 3"}) {
    const DecodedMesh decoded = decode_mesh(join({"v 0 0 0", "v 1 0 0", "v 1 1 0", face}), MeshFormat::kObj);
    EXPECT_DOUBLE_EQ(area(decoded.mesh), 0.5) << face;
    EXPECT_EQ(warning(decoded, "polygons_not_tiled"), "") << face;
  }
}

TEST(DecodePolygons, ConvexPolygonsStayFansAndPolygonsThatCrossThemselvesAreReported) {
  const DecodedMesh convex =
      decode_mesh(join({"v 0 0 0", "v 1 0 0", "v 1 1 0", "v 0 1 0", "f 1 2 3 4"}), MeshFormat::kObj);
  EXPECT_EQ(convex.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
  const DecodedMesh crossing =
      decode_mesh(join({"v 0 0 0", "v 2 2 0", "v 2 0 0", "v 0 1 0", "f 1 2 3 4"}), MeshFormat::kObj);
  EXPECT_EQ(crossing.mesh.triangles.size(), 2U);
  EXPECT_THAT(warning(crossing, "polygons_not_tiled"), HasSubstr("1 polygon"));
}

}  // namespace
}  // namespace crease::test
