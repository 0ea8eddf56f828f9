#include "core/io/appearance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "core/base/text.h"
#include "core/io/dropped_attributes.h"
#include "core/io/encode.h"
#include "tests/support/labelled_meshes.h"
#include "tests/unit/decode_samples.h"

namespace crease {
namespace {

using test::GltfSample;
using test::SampleFile;

/// Two squares that are folded along an edge, in four triangles.
Mesh folded_square() {
  return {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {1, 0, 1}, {1, 1, 1}},
          {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}}};
}

/// The square and its fold, with two materials and a seam of texture coordinates along the edge between them.
SampleFile rich_obj() {
  std::string text = "mtllib paint.mtl\ng part\n";
  const Mesh mesh = folded_square();
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    text += "v " + test::xyz(mesh.positions[v]) + fmt::format(" 0.{0} 0.5 0.{0}5\n", v);
  }
  text += "vt 0 0\nvt 0.5 0\nvt 0.5 1\nvt 0 1\nvt 0.75 0.25\nvt 1 0.25\nvt 1 0.5\nvt 0.75 0.5\n";
  return {"obj", MeshFormat::kObj,
          text + "usemtl red paint\nf 1/1 2/2 3/3 4/4\nusemtl blue\nf 2/5 5/6 6/7\nf 2/5 6/7 3/8\n"};
}

/// Texture coordinates per vertex, and opacity.
SampleFile rich_ply() {
  std::string text =
      test::join({"ply", "format ascii 1.0", "element vertex 6", "property float x", "property float y",
                  "property float z", "property uchar red", "property uchar green", "property uchar blue",
                  "property uchar alpha", "property float quality", "property float s", "property float t",
                  "element face 4", "property list uchar int vertex_indices", "property uchar red",
                  "property uchar green", "property uchar blue", "end_header"});
  const Mesh mesh = folded_square();
  for (std::size_t v = 0; v < 6; ++v) {
    text += test::xyz(mesh.positions[v]) + fmt::format(" {} {} 7 {} 0.5 0.{} 0.25\n", 40 * v, 255 - v, 200 + v, v);
  }
  for (std::size_t f = 0; f < 4; ++f) {
    const Triangle& t = mesh.triangles[f];
    text += fmt::format("3 {} {} {} {} 20 30\n", t[0], t[1], t[2], 50 * f);
  }
  return {"ply", MeshFormat::kPly, text};
}

/// Texture coordinates per corner.
SampleFile corner_ply() {
  std::string text =
      test::join({"ply", "format ascii 1.0", "element vertex 6", "property float x", "property float y",
                  "property float z", "property float nx", "property float ny", "property float nz", "element face 4",
                  "property list uchar int vertex_indices", "property list uchar float texcoord", "end_header"});
  const Mesh mesh = folded_square();
  for (const Vec3& position : mesh.positions) text += test::xyz(position) + " 0 0 1\n";
  for (std::size_t f = 0; f < 4; ++f) {
    const Triangle& t = mesh.triangles[f];
    text += fmt::format("3 {} {} {} 6 0.{} 0 0.5 0.{} 1 1\n", t[0], t[1], t[2], f, f);
  }
  return {"ply with corners", MeshFormat::kPly, text};
}

SampleFile rich_off() {
  std::string text = "COFF\n6 4 0\n";
  const Mesh mesh = folded_square();
  for (std::size_t v = 0; v < 6; ++v) text += test::xyz(mesh.positions[v]) + fmt::format(" {} 100 200 255\n", 30 * v);
  for (const Triangle& t : mesh.triangles) text += fmt::format("3 {} {} {} 0.25 0.5 0.75\n", t[0], t[1], t[2]);
  return {"off", MeshFormat::kOff, text};
}

/// Two primitives whose vertices lie at the same places along the edge, with other colours; materials, one with a
/// texture; two sets of texture coordinates.
SampleFile rich_glb() {
  const Mesh mesh = folded_square();
  GltfSample sample = test::gltf_sample({{mesh.positions.begin(), mesh.positions.begin() + 4}, {{0, 1, 2}, {0, 2, 3}}});
  sample.json["meshes"][0]["primitives"].push_back(sample.primitive());
  sample.primitive(1)["attributes"]["POSITION"] =
      sample.add_positions({mesh.positions[1], mesh.positions[4], mesh.positions[5], mesh.positions[2]});
  for (std::size_t p = 0; p < 2; ++p) {
    std::string colours, first, second;
    for (int v = 0; v < 4; ++v) {
      for (const float part : {0.25F, 0.1F * static_cast<float>(v), p == 0 ? 0.0F : 1.0F}) test::append(colours, part);
      for (const float part : {0.125F * static_cast<float>(v), 0.25F}) test::append(first, part);
      for (const float part : {0.5F, 0.0625F * static_cast<float>(v)}) test::append(second, part);
    }
    sample.primitive(p)["attributes"]["COLOR_0"] = sample.add(colours, 5126, "VEC3", 4);
    sample.primitive(p)["attributes"]["TEXCOORD_0"] = sample.add(first, 5126, "VEC2", 4);
    sample.primitive(p)["attributes"]["TEXCOORD_1"] = sample.add(second, 5126, "VEC2", 4);
    sample.primitive(p)["material"] = 1 - p;
  }
  const std::size_t pixels = sample.json["bufferViews"].size();
  sample.add("picture", 5121, "SCALAR", 7);
  sample.json["accessors"].erase(sample.json["accessors"].size() - 1);
  sample.json["images"] = {{{"bufferView", pixels}, {"mimeType", "image/png"}, {"name", "wood"}},
                           {{"uri", "data:image/jpeg;base64," + test::base64("drawing")}}};
  sample.json["textures"] = {{{"source", 0}, {"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}}};
  sample.json["materials"] = {
      {{"name", "steel"}, {"pbrMetallicRoughness", {{"metallicFactor", 0.5}}}, {"extras", {{"made", "by hand"}}}},
      {{"name", "oak"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}, {"texCoord", 1}}}}}}};
  sample.json["extensionsUsed"] = {"EXT_texture_webp", "KHR_lights_punctual"};
  return {"glb", MeshFormat::kGlb, sample.glb()};
}

std::vector<SampleFile> rich_files() {
  return {rich_obj(), rich_ply(), corner_ply(),
          rich_off(), rich_glb(), {"stl", MeshFormat::kStl, test::stl_binary_file(folded_square())}};
}

std::set<std::string> names_in(const DecodedMesh& decoded) {
  const std::vector<std::string> names = attributes_of(decoded.appearance, decoded.mesh.triangles);
  return {names.begin(), names.end()};
}

DecodedMesh converted(const DecodedMesh& input, MeshFormat format, const MeshStyle& style = {}) {
  LabelledMesh result = test::labelled(input.mesh);
  result.appearance = input.appearance;
  return decode_mesh(encode_mesh(result, format, {}, style), format);
}

using Values = std::optional<std::vector<float>>;

/// The colour at a corner, as sRGB.
Values colour_at(const DecodedMesh& decoded, std::size_t face, std::size_t place) {
  const Appearance& look = decoded.appearance;
  if (look.colours.empty()) return std::nullopt;
  const Colour colour = colours_of(look, false)[look.colours.at(decoded.mesh.triangles, face, place)];
  return Values(std::in_place, colour.begin(), colour.end());
}

Values texture_at(const DecodedMesh& decoded, std::size_t set, std::size_t face, std::size_t place) {
  const Appearance& look = decoded.appearance;
  if (look.texture.size() <= set) return std::nullopt;
  const Index number = look.texture[set].at(decoded.mesh.triangles, face, place);
  if (number == kNone) return std::nullopt;
  const auto value = texture_of(look, set, false)[number];
  return Values(std::in_place, value.begin(), value.end());
}

std::string material_at(const DecodedMesh& decoded, std::size_t face) {
  std::string name;
  for (const MaterialRun& run : decoded.appearance.material_runs) {
    if (run.first_face <= face) name = run.material == kNone ? "" : name_of(decoded.appearance, run.material);
  }
  return name;
}

void expect_near(const Values& is, const Values& expected, float tolerance) {
  ASSERT_EQ(is.has_value(), expected.has_value());
  if (is) {
    EXPECT_THAT(*is, ::testing::Pointwise(::testing::FloatNear(tolerance), *expected));
  }
}

bool keeps(const Format& format, std::string_view name) {
  return std::ranges::find(format.keeps, name) != format.keeps.end();
}

void expect_same_looks(const DecodedMesh& input, const DecodedMesh& output, const Format& format) {
  ASSERT_EQ(output.mesh.triangles.size(), input.mesh.triangles.size());
  const bool in_bytes = format.name == "ply" || format.name == "off";
  const bool one_per_vertex = !keeps(format, kCornerColours) && names_in(input).contains(std::string(kCornerColours));
  for (std::size_t face = 0; face < input.mesh.triangles.size(); ++face) {
    SCOPED_TRACE(face);
    for (std::size_t k = 0; k < 3; ++k) {
      Values colour = colour_at(input, face, k);
      if (colour && !keeps(format, kOpacity)) colour->back() = 1;
      if (keeps(format, kVertexColours) && !one_per_vertex) {
        expect_near(colour_at(output, face, k), colour, in_bytes ? 0.5F / 255 + 1e-6F : 1e-6F);
      }
      if (keeps(format, kTextureCoordinates))
        expect_near(texture_at(output, 0, face, k), texture_at(input, 0, face, k), 1e-6F);
      if (keeps(format, kFurtherTexture))
        expect_near(texture_at(output, 1, face, k), texture_at(input, 1, face, k), 1e-6F);
    }
    if (keeps(format, kMaterialNames)) {
      EXPECT_EQ(material_at(output, face), material_at(input, face));
    }
    if (!keeps(format, kFaceColours) || input.appearance.face_colours.empty()) continue;
    const Colour &is = output.appearance.face_colours.at(face), &expected = input.appearance.face_colours[face];
    for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(is[k], expected[k], 0.5 / 255 + 1e-6);
  }
}

TEST(Appearance, EveryPairOfFormatsKeepsWhatItNamesAndDropsTheRest) {
  for (const SampleFile& file : rich_files()) {
    const DecodedMesh input = decode_mesh(file.bytes, file.format);
    const std::set<std::string> before = names_in(input);
    for (const MeshFormat out : kMeshFormats) {
      const Format& format = format_row(out);
      if (format.read == nullptr) continue;
      SCOPED_TRACE(file.name + " as " + std::string(format.name));
      const DecodedMesh output = converted(input, out);
      const std::set<std::string> after = names_in(output);
      std::vector<std::string> lost;
      std::ranges::set_difference(before, after, std::back_inserter(lost));
      EXPECT_THAT(dropped_in(format, {before.begin(), before.end()}), ::testing::UnorderedElementsAreArray(lost));
      if (out != MeshFormat::kStl) expect_same_looks(input, output, format);
    }
  }
}

TEST(Appearance, TheWarningNamesEverythingAndTheFormatsThatKeepIt) {
  const std::string obj = test::warning(decode_mesh(rich_obj().bytes, MeshFormat::kObj), "attributes_dropped");
  EXPECT_EQ(obj,
            "format=original keeps everything; lost in all other formats: groups; lost in all other formats but glb, "
            "gltf, obj, ply and off: vertex colours; lost in all other formats but glb, gltf, obj and ply: texture "
            "coordinates; lost in all other formats but glb, gltf and obj: material names; lost in all other formats "
            "but obj: material libraries");
  for (const SampleFile& plain : test::sample_files(folded_square())) {
    EXPECT_EQ(test::warning(decode_mesh(plain.bytes, plain.format), "attributes_dropped"), "") << plain.name;
  }
}

/// The cells of a row of a table in Markdown.
std::vector<std::string> cells_of(const std::string& row) {
  std::vector<std::string> cells;
  std::istringstream text(row);
  std::string cell;
  std::getline(text, cell, '|');
  while (std::getline(text, cell, '|')) cells.emplace_back(trimmed(cell));
  return cells;
}

TEST(Appearance, TheReadmeSaysWhatFormatsKeep) {
  std::ifstream readme(std::string(CREASED_SOURCE_DIR) + "/README.md");
  std::string line;
  while (std::getline(readme, line) && !line.starts_with("| of the upload |")) continue;
  const std::vector<std::string> columns = cells_of(line);
  std::map<std::string, std::vector<std::string>> rows;
  while (std::getline(readme, line) && line.starts_with("|")) rows[cells_of(line).at(0)] = cells_of(line);
  for (const std::string_view name : {kVertexColours, kOpacity, kCornerColours, kFaceColours, kTextureCoordinates,
                                      kFurtherTexture, kMaterialNames, kMaterials, kTextures, kMaterialLibraries}) {
    const std::string attribute(name);
    ASSERT_TRUE(rows.contains(attribute)) << attribute;
    for (const MeshFormat format : kMeshFormats) {
      const auto column = std::ranges::find_if(columns, [&](const std::string& titles) {
        return titles.find(format_row(format).title) != std::string::npos;
      });
      ASSERT_NE(column, columns.end()) << format_name(format);
      const std::string& cell = rows[attribute].at(static_cast<std::size_t>(column - columns.begin()));
      const bool kept = cell != "–" && cell != "the first";
      EXPECT_EQ(dropped_in(format_row(format), {attribute}).empty(), kept) << attribute << ", " << format_name(format);
    }
  }
}

TEST(Appearance, TheNamesOfWhatIsLostAreThoseOfTheFile) {
  const auto dropped = [](const SampleFile& file, MeshFormat format) {
    const DecodedMesh input = decode_mesh(file.bytes, file.format);
    return dropped_in(format_row(format), attributes_of(input.appearance, input.mesh.triangles));
  };
  using ::testing::UnorderedElementsAre;
  EXPECT_THAT(dropped(rich_obj(), MeshFormat::kGlb), UnorderedElementsAre("groups", "material libraries"));
  EXPECT_THAT(dropped(rich_obj(), MeshFormat::kObj), UnorderedElementsAre("groups"));
  EXPECT_THAT(dropped(rich_ply(), MeshFormat::kPly), UnorderedElementsAre("vertex property quality"));
  EXPECT_THAT(dropped(rich_ply(), MeshFormat::kObj),
              UnorderedElementsAre("vertex property quality", "opacity of colours", "face colours"));
  EXPECT_THAT(dropped(rich_off(), MeshFormat::kPly), UnorderedElementsAre());
  EXPECT_THAT(dropped(rich_off(), MeshFormat::kGlb), UnorderedElementsAre("face colours"));
  EXPECT_THAT(dropped(rich_glb(), MeshFormat::kGltf), UnorderedElementsAre("extension KHR_lights_punctual"));
  EXPECT_THAT(dropped(rich_glb(), MeshFormat::kPly),
              UnorderedElementsAre("extension KHR_lights_punctual", "colours that differ at one vertex",
                                   "further texture coordinates", "material names", "materials", "textures"));
}

TEST(Appearance, MaterialsAndTexturesOfGltfStayAsTheyAre) {
  const SampleFile file = rich_glb();
  const DecodedMesh input = decode_mesh(file.bytes, file.format);
  const auto json_of = [](const std::string& glb) {
    std::uint32_t length = 0;
    std::memcpy(&length, glb.data() + 12, 4);
    return nlohmann::json::parse(glb.substr(20, length));
  };
  LabelledMesh result = test::labelled(input.mesh);
  result.appearance = input.appearance;
  const std::string bytes = encode_mesh(result, MeshFormat::kGlb);
  const auto before = json_of(file.bytes), after = json_of(bytes);
  for (const auto& primitive : after["meshes"][0]["primitives"]) {
    if (primitive["mode"] != 4) continue;
    const auto& material = after["materials"].at(primitive["material"].get<std::size_t>());
    EXPECT_EQ(std::ranges::count(before["materials"], material), 1) << material;
  }
  EXPECT_EQ(after["textures"], before["textures"]);
  EXPECT_EQ(after["images"][0]["name"], "wood");
  EXPECT_THAT(after["extensionsUsed"], ::testing::Contains("EXT_texture_webp"));
  EXPECT_THAT(after["extensionsUsed"], ::testing::Not(::testing::Contains("KHR_lights_punctual")));
  EXPECT_EQ(after["images"][1]["mimeType"], "image/jpeg");
  EXPECT_FALSE(after["images"][1].contains("uri"));
  for (const char* content : {"picture", "drawing"}) EXPECT_NE(bytes.find(content), std::string::npos);
  // The colours and the texture coordinates of glTF come back to the bit.
  const DecodedMesh again = decode_mesh(bytes, MeshFormat::kGlb);
  for (std::size_t face = 0; face < 4; ++face) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(colour_at(again, face, k), colour_at(input, face, k));
      EXPECT_EQ(texture_at(again, 0, face, k), texture_at(input, 0, face, k));
    }
  }
}

TEST(Appearance, ColoursAreLinearInGltfAndTextureCoordinatesStartAtTheTop) {
  LabelledMesh result = test::labelled(folded_square());
  result.appearance = decode_mesh(rich_obj().bytes, MeshFormat::kObj).appearance;
  const DecodedMesh glb = decode_mesh(encode_mesh(result, MeshFormat::kGlb), MeshFormat::kGlb);
  const Colour colour = glb.appearance.colours.values[glb.appearance.colours.at(glb.mesh.triangles, 0, 0)];
  // IEC 61966-2-1: 0.5 is 0.2140 in linear light, and 0.05 is 0.0039.
  EXPECT_NEAR(colour[1], 0.21404, 1e-5);
  EXPECT_NEAR(colour[2], std::pow((0.05 + 0.055) / 1.055, 2.4), 1e-5);
  const Index corner = glb.appearance.texture[0].at(glb.mesh.triangles, 0, 2);
  EXPECT_EQ(glb.appearance.texture[0].values[corner], (std::array<float, 2>{0.5F, 0}));  // from the bottom: 0.5 1
}

TEST(Appearance, ColoursOfBytesComeBackThroughGlb) {
  const DecodedMesh input = decode_mesh(rich_ply().bytes, MeshFormat::kPly);
  const DecodedMesh output = converted(converted(input, MeshFormat::kGlb), MeshFormat::kPly);
  for (std::size_t v = 0; v < 6; ++v)
    EXPECT_EQ(output.appearance.colours.values[v], input.appearance.colours.values[v]);
}

TEST(Appearance, TextureFollowsTheCornersOfAPolygonThatIsNoFan) {
  // A U of eight corners, whose texture coordinates are its own x and y.
  const std::vector<std::array<int, 2>> corners{{0, 0}, {3, 0}, {3, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 3}, {0, 3}};
  std::string text, face = "f";
  for (std::size_t i = 0; i < corners.size(); ++i) {
    text += fmt::format("v {0} {1} 0\nvt {0} {1}\n", corners[i][0], corners[i][1]);
    face += fmt::format(" {0}/{0}", i + 1);
  }
  const DecodedMesh u = decode_mesh(text + face + "\n", MeshFormat::kObj);
  ASSERT_EQ(u.mesh.triangles.size(), 6U);
  for (std::size_t f = 0; f < 6; ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& position = u.mesh.positions[u.mesh.triangles[f][k]];
      expect_near(texture_at(u, 0, f, k),
                  Values(std::in_place, {static_cast<float>(position.x()), static_cast<float>(position.y())}), 0);
    }
  }
}

TEST(Appearance, FacesKeepTheirOrderWhereMaterialsTakeTurns) {
  std::string text = test::obj_file({folded_square().positions, {}});
  for (std::size_t f = 0; f < 4; ++f) {
    const Triangle t = folded_square().triangles[f];
    text += fmt::format("usemtl {}\nf {} {} {}\n", f % 2 == 0 ? "even" : "odd", t[0] + 1, t[1] + 1, t[2] + 1);
  }
  const DecodedMesh input = decode_mesh(text, MeshFormat::kObj);
  const DecodedMesh output = converted(input, MeshFormat::kGlb);
  EXPECT_EQ(output.mesh.triangles, input.mesh.triangles);
  for (std::size_t f = 0; f < 4; ++f) EXPECT_EQ(material_at(output, f), f % 2 == 0 ? "even" : "odd");
}

TEST(Appearance, NormalsAreWrittenWhereTheUploadHadThem) {
  const DecodedMesh input = decode_mesh(corner_ply().bytes, MeshFormat::kPly);
  LabelledMesh result = test::labelled(input.mesh);
  for (const bool has_normals : {false, true}) {
    result.appearance.has_normals = has_normals;
    EXPECT_EQ(encode_mesh(result, MeshFormat::kObj).find("\nvn ") != std::string::npos, has_normals);
    EXPECT_EQ(encode_mesh(result, MeshFormat::kPly).find("property float nx") != std::string::npos, has_normals);
    EXPECT_EQ(encode_mesh(result, MeshFormat::kOff).starts_with("NOFF"), has_normals);
  }
  // The fold is a ridge, so its corners have the normals of their own sides.
  const std::string obj = encode_mesh(result, MeshFormat::kObj);
  EXPECT_NE(obj.find("vn 0 0 1"), std::string::npos);
  EXPECT_NE(obj.find("vn -1 0 0"), std::string::npos);
}

/// What is odd in the looks of a file is named, and nothing else is refused for it.
TEST(Appearance, OddLooksAreDroppedByName) {
  const auto names = [](const std::string& bytes, MeshFormat format) { return names_in(decode_mesh(bytes, format)); };
  const std::string faces = "f 1/1 2/2 3/3\n";
  using ::testing::ElementsAre;
  EXPECT_THAT(names("v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", MeshFormat::kObj),
              ElementsAre("vertex colours or other numbers behind positions"));
  EXPECT_THAT(names("v 0 0 0 9 9 9\nv 1 0 0 9 9 9\nv 0 1 0 9 9 9\nf 1 2 3\n", MeshFormat::kObj),
              ElementsAre("vertex colours or other numbers behind positions"));
  EXPECT_THAT(names("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n" + faces, MeshFormat::kObj),
              ElementsAre("numbers of texture coordinates that do not exist", "texture coordinates"));
  EXPECT_THAT(names("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt nan 0\nvt 1 0\nvt 0 1\n" + faces, MeshFormat::kObj),
              ElementsAre("texture coordinates", "texture coordinates that are no finite numbers"));
  EXPECT_THAT(names("OFF\n3 1 0\n0 0 0 7\n1 0 0 7\n0 1 0 7\n3 0 1 2 5\n", MeshFormat::kOff),
              ElementsAre("face colours", "vertex colours or other numbers behind positions"));
  GltfSample sample = test::gltf_sample(folded_square());
  std::string bright;
  for (int i = 0; i < 18; ++i) test::append(bright, 2.0F);
  sample.primitive()["attributes"]["COLOR_0"] = sample.add(bright, 5126, "VEC3", 6);
  EXPECT_THAT(names(sample.glb(), MeshFormat::kGlb), ElementsAre("colours that are not from 0 to 1", "vertex colours"));
}

}  // namespace
}  // namespace crease
