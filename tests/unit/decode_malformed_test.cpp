#include <gtest/gtest.h>

#include "tests/unit/decode_samples.h"

namespace crease::test {
namespace {

struct Malformed {
  std::string name;
  MeshFormat format;
  std::string bytes;
  ErrorCode code;
  std::string place;
};

void PrintTo(const Malformed& malformed, std::ostream* out) { *out << malformed.name; }

class DecodeMalformed : public testing::TestWithParam<Malformed> {};

TEST_P(DecodeMalformed, IsRefusedWithCodeAndPlace) {
  const std::optional<Error> error = refusal(GetParam().bytes, GetParam().format);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->code(), GetParam().code) << error->detail();
  EXPECT_EQ(error->place(), GetParam().place) << error->detail();
}

std::string ply(const std::vector<std::string>& header, const std::string& body = {}) {
  return "ply\n" + join(header) + "end_header\n" + body;
}

const std::string kCorners = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
const std::vector<std::string> kXyz{"property float x", "property float y", "property float z"};

std::vector<std::string> ply_lines(const std::string& format, const std::string& vertices, const std::string& faces) {
  return {"format " + format + " 1.0",
          "element vertex " + vertices,
          kXyz[0],
          kXyz[1],
          kXyz[2],
          "element face " + faces,
          "property list uchar int vertex_indices"};
}

std::string with_bytes(std::string bytes, std::size_t at, const std::string& replacement) {
  return bytes.replace(at, replacement.size(), replacement);
}

std::vector<Malformed> malformed_obj() {
  using enum MeshFormat;
  return {
      {"obj_vertex_of_two", kObj, "v 0 0\nf 1 1 1\n", code::kMeshSyntax, "line 1"},
      {"obj_cut_in_a_vertex", kObj, "v 0 0 0\nv 1 0", code::kMeshTruncated, "line 2"},
      {"obj_word_for_number", kObj, "v 0 0 zero\n", code::kMeshSyntax, "line 1"},
      {"obj_number_with_tail", kObj, "v 0 0 1.5x\n", code::kMeshSyntax, "line 1"},
      {"obj_nan", kObj, "v 0 0 0\nv nan 0 0\n", code::kMeshNotFinite, "line 2"},
      {"obj_infinity", kObj, "v 0 -inf 0\n", code::kMeshNotFinite, "line 1"},
      {"obj_beyond_double", kObj, "# c\n\nv 0 1e999 0\n", code::kMeshNotFinite, "line 3"},
      {"obj_only_a_face_of_two", kObj, kCorners + "f 1 2\n", code::kMeshNoFaces, "byte 30"},
      {"obj_only_a_face_of_none", kObj, kCorners + "f\n", code::kMeshNoFaces, "byte 26"},
      {"obj_index_zero", kObj, kCorners + "f 1 2 3\nf 0 1 2\n", code::kMeshIndexOutOfRange, "face 1"},
      {"obj_index_beyond", kObj, kCorners + "f 1 2 3\nf 1 2 4\n", code::kMeshIndexOutOfRange, "face 1"},
      {"obj_index_huge", kObj, kCorners + "f 1 2 99999999999\n", code::kMeshIndexOutOfRange, "face 0"},
      {"obj_index_negative_beyond", kObj, kCorners + "f 1 2 -4\n", code::kMeshIndexOutOfRange, "face 0"},
      {"obj_index_of_33_digits", kObj, kCorners + "f 1 2 " + std::string(33, '9') + "\n", code::kMeshSyntax, "line 4"},
      {"obj_index_is_word", kObj, kCorners + "f 1 2 c\n", code::kMeshSyntax, "line 4"},
      {"obj_index_is_fraction", kObj, kCorners + "f 1 2 3.5\n", code::kMeshSyntax, "line 4"},
      {"obj_without_faces", kObj, "v 0 0 0\n", code::kMeshNoFaces, "byte 8"},
      {"obj_only_blank", kObj, " \n\r\n", code::kMeshEmpty, "byte 0"},
      {"obj_empty", kObj, "", code::kMeshEmpty, "byte 0"},
      {"obj_that_is_ply", kObj, ply_ascii_file(sample_mesh()), code::kMeshSyntax, "byte 0"},
      {"json_is_not_read", MeshFormat::kJson, R"({"positions": []})", code::kMeshUnsupported, "byte 0"},
  };
}

std::vector<Malformed> malformed_off() {
  using enum MeshFormat;
  const std::string corners = "0 0 0\n1 0 0\n1 1 0\n";
  return {
      {"off_no_counts", kOff, "OFF\n", code::kMeshTruncated, "line 2"},
      {"off_one_count", kOff, "OFF\n3\n" + corners, code::kMeshTruncated, "line 3"},
      {"off_negative_count", kOff, "OFF\n-3 1 0\n" + corners, code::kMeshSyntax, "line 2"},
      {"off_fraction_count", kOff, "OFF\n3.5 1 0\n" + corners, code::kMeshSyntax, "line 2"},
      {"off_vertices_beyond_bytes", kOff, "OFF\n1000000 1 0\n" + corners, code::kMeshTruncated, "line 2"},
      {"off_faces_beyond_bytes", kOff, "OFF\n3 1000000 0\n" + corners, code::kMeshTruncated, "line 2"},
      {"off_vertices_beyond_limit", kOff, "OFF\n4294967295 1 0\n" + corners, code::kMeshTooLarge, "line 2"},
      {"off_count_beyond_64_bits", kOff, "OFF 99999999999999999999999 1 0\n", code::kMeshTooLarge, "line 1"},
      {"off_face_line_missing", kOff, "OFF\n3 2 0\n" + corners + "3 0 1 2    \n\n\n\n\n", code::kMeshTruncated,
       "line 11"},
      {"off_short_vertex", kOff, "OFF\n3 1 0\n0 0 0\n1 0\n1 1 0\n3 0 1 2\n", code::kMeshSyntax, "line 5"},
      {"off_nan", kOff, "OFF\n3 1 0\n0 0 0\n1 nan 0\n1 1 0\n3 0 1 2\n", code::kMeshNotFinite, "line 4"},
      {"off_only_a_face_of_two", kOff, "OFF\n3 1 0\n" + corners + "2 0 1   \n", code::kMeshNoFaces, "byte 37"},
      {"off_face_promises_more", kOff, "OFF\n3 1 0\n" + corners + "4 0 1 2\n", code::kMeshSyntax, "line 6"},
      {"off_face_promises_billions", kOff, "OFF\n3 1 0\n" + corners + "4000000000 0 1 2\n", code::kMeshSyntax,
       "line 6"},
      {"off_index_beyond", kOff, "OFF\n3 1 0\n" + corners + "3 0 1 3\n", code::kMeshIndexOutOfRange, "face 0"},
      {"off_index_negative", kOff, "OFF\n3 1 0\n" + corners + "3 0 1 -1\n", code::kMeshIndexOutOfRange, "face 0"},
      {"off_four_dimensions", kOff, "4OFF\n3 1 0\n" + corners, code::kMeshUnsupported, "line 1"},
      {"off_binary", kOff, "OFF BINARY\n\1\2\3", code::kMeshUnsupported, "line 1"},
      {"off_no_faces", kOff, "OFF\n3 0 0\n" + corners, code::kMeshNoFaces, "byte 28"},
  };
}

std::vector<Malformed> malformed_ply() {
  using enum MeshFormat;
  const std::string corners = "0 0 0\n1 0 0\n1 1 0\n";
  const std::string little = "binary_little_endian";
  const std::string good = ply_binary_file(sample_mesh(), false);
  const std::size_t body = good.find("end_header\n") + 11;
  const std::size_t faces = body + 5 * 12;
  return {
      {"ply_header_without_end", kPly, "ply\nformat ascii 1.0\n", code::kMeshTruncated, "line 3"},
      {"ply_no_format", kPly, ply({"element face 0"}), code::kMeshSyntax, "line 3"},
      {"ply_unknown_format", kPly, ply({"format ebcdic 1.0"}), code::kMeshSyntax, "line 2"},
      {"ply_version_2", kPly, ply({"format ascii 2.0"}), code::kMeshUnsupported, "line 2"},
      {"ply_unknown_keyword", kPly, ply({"format ascii 1.0", "elephant"}), code::kMeshSyntax, "line 3"},
      {"ply_unknown_type", kPly, ply({"format ascii 1.0", "element vertex 1", "property half x"}), code::kMeshSyntax,
       "line 4"},
      {"ply_float_list_length", kPly, ply({"format ascii 1.0", "element face 1", "property list float int v"}),
       code::kMeshSyntax, "line 4"},
      {"ply_float_indices", kPly, ply({"format ascii 1.0", "element face 1", "property list uchar float vertex_index"}),
       code::kMeshSyntax, "line 3"},
      {"ply_property_first", kPly, ply({"format ascii 1.0", "property float x"}), code::kMeshSyntax, "line 3"},
      {"ply_two_vertex_elements", kPly, ply({"format ascii 1.0", "element vertex 0", "element vertex 0"}),
       code::kMeshSyntax, "line 4"},
      {"ply_no_z", kPly, ply({"format ascii 1.0", "element vertex 3", kXyz[0], kXyz[1]}), code::kMeshSyntax, "line 3"},
      {"ply_no_list", kPly, ply({"format ascii 1.0", "element face 1", "property int a"}, "1\n"), code::kMeshNoFaces,
       "line 3"},
      {"ply_negative_count", kPly, ply(ply_lines("ascii", "-1", "1")), code::kMeshSyntax, "line 3"},
      {"ply_count_beyond_64_bits", kPly, ply(ply_lines("ascii", std::string(30, '9'), "1")), code::kMeshTooLarge,
       "line 3"},
      {"ply_vertices_beyond_limit", kPly, ply(ply_lines(little, "4294967295", "1")), code::kMeshTooLarge, "line 3"},
      {"ply_vertices_beyond_bytes", kPly, ply(ply_lines(little, "19000000", "1"), corners), code::kMeshTruncated,
       "line 3"},
      {"ply_faces_beyond_bytes", kPly, ply(ply_lines("ascii", "3", "19000000"), corners), code::kMeshTruncated,
       "line 7"},
      {"ply_other_element_beyond_bytes", kPly,
       ply({"format " + little + " 1.0", "element a 18446744073709551615", "property double d"}), code::kMeshTruncated,
       "line 3"},
      {"ply_header_of_too_many_lines", kPly, ply(std::vector<std::string>(20'000, "comment c")), code::kMeshTooLarge,
       "line 10001"},
      {"ply_ascii_short_line", kPly, ply(ply_lines("ascii", "3", "1"), "0 0 0\n1 0\n1 1 0\n3 0 1 2\n"),
       code::kMeshSyntax, "line 12"},
      {"ply_ascii_long_line", kPly, ply(ply_lines("ascii", "3", "1"), "0 0 0\n1 0 0 7\n1 1 0\n3 0 1 2\n"),
       code::kMeshSyntax, "line 11"},
      {"ply_ascii_infinity", kPly, ply(ply_lines("ascii", "3", "1"), "0 0 0\n1 0 0\ninf 1 0\n3 0 1 2\n"),
       code::kMeshNotFinite, "line 12"},
      {"ply_ascii_cut", kPly, ply(ply_lines("ascii", "3", "1"), corners + "3 0 1     "), code::kMeshTruncated,
       "line 13"},
      {"ply_ascii_index_beyond", kPly, ply(ply_lines("ascii", "3", "1"), corners + "3 0 1 3\n"),
       code::kMeshIndexOutOfRange, "face 0"},
      {"ply_binary_nan", kPly, with_bytes(good, body + 12, std::string("\0\0\xc0\x7f", 4)), code::kMeshNotFinite,
       fmt::format("byte {}", body + 12)},
      {"ply_binary_index_beyond", kPly, with_bytes(good, faces + 13 + 9, "\x05"), code::kMeshIndexOutOfRange, "face 1"},
      {"ply_binary_index_negative", kPly, with_bytes(good, faces + 1, "\xff\xff\xff\xff"), code::kMeshIndexOutOfRange,
       "face 0"},
      {"ply_binary_list_beyond_bytes", kPly, with_bytes(good, faces + 26, "\xff"), code::kMeshTruncated,
       fmt::format("byte {}", faces + 27)},
      {"ply_binary_cut", kPly, good.substr(0, good.size() - 1), code::kMeshTruncated,
       fmt::format("byte {}", faces + 27)},
  };
}

std::vector<Malformed> malformed_stl() {
  using enum MeshFormat;
  const std::string good = stl_binary_file(connected_sample());
  const std::string facet =
      "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n";
  return {
      {"stl_head_cut", kStl, good.substr(0, 50), code::kMeshTruncated, "byte 0"},
      {"stl_count_cut", kStl, good.substr(0, 82), code::kMeshTruncated, "byte 80"},
      {"stl_facet_cut", kStl, good.substr(0, good.size() - 1), code::kMeshTruncated, "byte 80"},
      {"stl_count_beyond_bytes", kStl, with_bytes(good, 80, "\x04"), code::kMeshTruncated, "byte 80"},
      {"stl_count_of_billions", kStl, with_bytes(good, 80, "\xff\xff\xff\xff"), code::kMeshTruncated, "byte 80"},
      {"stl_no_facets", kStl, good.substr(0, 80) + std::string(4, '\0'), code::kMeshNoFaces, "byte 84"},
      {"stl_binary_nan", kStl, with_bytes(good, 84 + 50 + 12, "\xff\xff\xff\xff"), code::kMeshNotFinite, "byte 146"},
      {"stl_ascii_without_facets_or_end", kStl, "solid a\n", code::kMeshTruncated, "line 2"},
      {"stl_ascii_two_corners", kStl, "solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n",
       code::kMeshTruncated, "line 7"},
      {"stl_ascii_nan", kStl, "solid\nfacet normal 0 0 0\nouter loop\nvertex nan 0 0\n", code::kMeshNotFinite,
       "line 4"},
      {"stl_ascii_unknown_word", kStl, "solid\nfacet normal 0 0 0\nouter ring\n", code::kMeshSyntax, "line 3"},
      {"stl_ascii_no_facets", kStl, "solid a\nendsolid a\n", code::kMeshNoFaces, "byte 19"},
      {"stl_ascii_misspelt_facet", kStl, "solid a\nfacets normal 0 0 0\n" + facet.substr(facet.find("outer")),
       code::kMeshSyntax, "line 3"},
      {"stl_ascii_misspelt_vertex", kStl, "solid a\nfacet normal 0 0 0\nouter loop\nvertx 0 0 0\n", code::kMeshSyntax,
       "line 4"},
      {"stl_ascii_vertex_without_keyword", kStl, "solid a\nfacet normal 0 0 0\nouter loop\n\n0 0 1e-3\n",
       code::kMeshSyntax, "line 5"},
      {"stl_ascii_facet_in_a_facet", kStl, "solid a\nfacet normal 0 0 0\nouter loop\n" + facet, code::kMeshSyntax,
       "line 4"},
      {"stl_ascii_vertex_behind_the_end", kStl, "solid a\n" + facet + "endsolid a\nvertex 0 0 0\n", code::kMeshSyntax,
       "line 10"},
      {"stl_ascii_numbers_behind_a_vertex", kStl, "solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0 , 1 0 0\n",
       code::kMeshSyntax, "line 4"},
  };
}

std::vector<Malformed> malformed_glb() {
  using enum MeshFormat;
  const std::string good = gltf_sample(sample_mesh()).glb();
  return {
      {"glb_head_cut", kGlb, good.substr(0, 10), code::kMeshTruncated, "byte 8"},
      {"glb_version_1", kGlb, with_bytes(good, 4, "\x01"), code::kMeshUnsupported, "byte 4"},
      {"glb_cut", kGlb, good.substr(0, good.size() - 1), code::kMeshTruncated, "byte 8"},
      {"glb_length_too_small", kGlb, with_bytes(good, 8, std::string("\4\0\0\0", 4)), code::kMeshSyntax, "byte 8"},
      {"glb_chunk_too_long", kGlb, with_bytes(good, 12, "\xff\xff\xff\x7f"), code::kMeshTruncated, "byte 20"},
      {"glb_first_chunk_binary", kGlb, with_bytes(good, 16, "BIN"), code::kMeshSyntax, "byte 12"},
      {"glb_json_broken", kGlb, with_bytes(good, 20, "["), code::kMeshSyntax, "byte 32"},
      {"gltf_not_json", kGltf, "not json", code::kMeshSyntax, "byte 1"},
      {"gltf_no_object", kGltf, "[1, 2]", code::kMeshSyntax, "asset"},
  };
}

std::vector<Malformed> all_malformed() {
  std::vector<Malformed> all;
  for (const auto& table : {malformed_obj(), malformed_off(), malformed_ply(), malformed_stl(), malformed_glb()}) {
    all.insert(all.end(), table.begin(), table.end());
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Table, DecodeMalformed, testing::ValuesIn(all_malformed()),
                         [](const auto& parameter) { return parameter.param.name; });

TEST(DecodeMalformed, UnrecognisableBytesHaveAnUnknownFormat) {
  for (const std::string& bytes :
       {std::string("\x1f\x8b\x08 not a mesh"), std::string(100, '\0'), std::string("<x/>")}) {
    const std::optional<Error> error = refusal(bytes);
    ASSERT_TRUE(error.has_value());
    EXPECT_EQ(error->code(), code::kMeshFormatUnknown);
  }
}

TEST(DecodeMalformed, DetailsQuoteOnlyPrintableText) {
  const std::optional<Error> error = refusal("v 0 0 \xff\x01" + std::string(1000, 'x') + "\n", MeshFormat::kObj);
  ASSERT_TRUE(error.has_value());
  EXPECT_LT(error->detail().size(), 100U);
  for (const char c : error->detail()) EXPECT_TRUE(c >= ' ' && c <= '~');
}

}  // namespace
}  // namespace crease::test
