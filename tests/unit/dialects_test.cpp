#include <gtest/gtest.h>

#include <algorithm>

#include "core/job.h"
#include "core/measure/noise.h"
#include "tests/support/meshes.h"
#include "tests/unit/decode_samples.h"

namespace crease::test {
namespace {

/// A noisy part whose vertices are in the order in which its faces first use them, and fit into single precision: every
/// format gives the same numbers in the same order.
Mesh plain_part() {
  const Mesh part = add_noise(cad_part(1).mesh, 0.15, 1, NoiseKind::kNormal);
  Mesh result;
  std::vector<Index> number(part.positions.size(), kNone);
  for (Triangle triangle : part.triangles) {
    for (Index& corner : triangle) {
      if (number[corner] == kNone) {
        number[corner] = static_cast<Index>(result.positions.size());
        result.positions.push_back(part.positions[corner]);
      }
      corner = number[corner];
    }
    result.triangles.push_back(triangle);
  }
  return in_single_precision(result);
}

std::string changed(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

/// The corners of each face behind `before`, written by `corner`.
template <typename Corner>
std::string faces_of(const Mesh& mesh, const std::string& before, const Corner& corner) {
  std::string text;
  for (const Triangle& triangle : mesh.triangles) {
    text += before;
    for (const Index vertex : triangle) text += " " + corner(vertex);
    text += "\n";
  }
  return text;
}

std::string positions_of(const Mesh& mesh, const std::string& before, const std::string& behind = "") {
  std::string text;
  for (const Vec3& position : mesh.positions) text += before + xyz(position) + behind + "\n";
  return text;
}

std::vector<SampleFile> obj_dialects(const Mesh& mesh) {
  const std::string plain = obj_file(mesh), vertices = positions_of(mesh, "v ");
  const auto count = mesh.positions.size();
  const auto with = [&](const std::string& head, const auto& corner) {
    return head + vertices + faces_of(mesh, "f", corner);
  };
  std::string soup;
  for (const Triangle& triangle : mesh.triangles) {
    for (const Index vertex : triangle) soup += "v " + xyz(mesh.positions[vertex]) + "\n";
    soup += "f -3 -2 -1\n";
  }
  return {
      {"obj_crlf", MeshFormat::kObj, changed(plain, "\n", "\r\n")},
      {"obj_cr", MeshFormat::kObj, changed(plain, "\n", "\r")},
      {"obj_tabs", MeshFormat::kObj, changed(plain, " ", "\t  ")},
      {"obj_continued_lines", MeshFormat::kObj, changed(plain, "f ", "f \\\n")},
      {"obj_texture", MeshFormat::kObj, with("vt 0.5 0.5\n", [](Index v) { return fmt::format("{}/1", v + 1); })},
      {"obj_normals", MeshFormat::kObj, with("vn 0 0 1\n", [](Index v) { return fmt::format("{}//1", v + 1); })},
      {"obj_both", MeshFormat::kObj,
       with("mtllib a.mtl\nvt 0 0\nvn 0 0 1\ng a b\ns off\nusemtl m\n",
            [](Index v) { return fmt::format("{}/-1/-1", v + 1); })},
      {"obj_negative", MeshFormat::kObj, with("", [&](Index v) { return fmt::format("-{}", count - v); })},
      {"obj_faces_first", MeshFormat::kObj,
       faces_of(mesh, "f", [](Index v) { return std::to_string(v + 1); }) + vertices},
      {"obj_colours", MeshFormat::kObj,
       positions_of(mesh, "v ", " 1 0.5 0.25") + faces_of(mesh, "f", [](Index v) { return std::to_string(v + 1); })},
      {"obj_soup", MeshFormat::kObj, soup}};
}

std::vector<SampleFile> off_dialects(const Mesh& mesh) {
  const std::string counts = fmt::format("{} {} 0\n", mesh.positions.size(), mesh.triangles.size());
  const std::string faces = faces_of(mesh, "3", [](Index v) { return std::to_string(v); });
  const std::string plain = counts + positions_of(mesh, "") + faces;
  return {{"off_no_keyword", MeshFormat::kOff, plain},
          {"off_joined", MeshFormat::kOff, "OFF" + plain},
          {"off_lower_case", MeshFormat::kOff, "off\n" + plain},
          {"off_comments", MeshFormat::kOff, "# a\nOFF # b\n\n" + plain},
          {"off_colours", MeshFormat::kOff, "COFF\n" + counts + positions_of(mesh, "", " 255 0 0 255") + faces},
          {"off_normals", MeshFormat::kOff, "NOFF\n" + counts + positions_of(mesh, "", " 0 0 1") + faces},
          {"off_texture", MeshFormat::kOff, "STOFF\n" + counts + positions_of(mesh, "", " 0.5 0.5") + faces},
          {"off_face_colours", MeshFormat::kOff,
           "OFF\n" + counts + positions_of(mesh, "") + changed(faces, "\n", " 1 0 0\n")},
          {"off_counts_apart", MeshFormat::kOff, "OFF\n" + changed(counts, " ", "\n") + positions_of(mesh, "") + faces},
          {"off_one_line", MeshFormat::kOff, changed("OFF\n" + plain, "\n", " ")},
          {"off_one_line_of_vertices", MeshFormat::kOff,
           "OFF\n" + counts + changed(positions_of(mesh, ""), "\n", "  ") + "\n" + faces},
          {"off_one_line_of_colours", MeshFormat::kOff,
           changed("COFF\n" + counts + positions_of(mesh, "", " 255 0 0 255") + changed(faces, "\n", " 1 0 0\n"), "\n",
                   "\t")},
          {"off_one_number_a_line", MeshFormat::kOff, changed("OFF\n" + plain, " ", "\n")}};
}

std::vector<SampleFile> ply_dialects(const Mesh& mesh) {
  const std::string plain = ply_ascii_file(mesh);
  const std::string binary = ply_binary_file(mesh, false);
  std::string strips = fmt::format("element tristrips 1\nproperty list int int vertex_indices\nend_header\n");
  strips += positions_of(mesh, "") + fmt::format("{}", 4 * mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles) strips += fmt::format(" {} {} {} -1", a, b, c);
  const std::string head = plain.substr(0, plain.find("element face"));
  return {{"ply_crlf", MeshFormat::kPly, changed(plain, "\n", "\r\n")},
          {"ply_doubles", MeshFormat::kPly, changed(plain, "property float", "property float64")},
          {"ply_vertex_index", MeshFormat::kPly, changed(plain, "vertex_indices", "vertex_index")},
          {"ply_types", MeshFormat::kPly, changed(plain, "list uchar int", "list uint32 uint16")},
          {"ply_comments", MeshFormat::kPly, changed(plain, "end_header", "comment x\nobj_info y\nend_header")},
          {"ply_colours", MeshFormat::kPly,
           changed(head, "property float z", "property float z\nproperty uchar red") +
               plain.substr(plain.find("element face"), plain.find("end_header") + 11 - plain.find("element face")) +
               positions_of(mesh, "", " 200") + faces_of(mesh, "3", [](Index v) { return std::to_string(v); })},
          {"ply_strips", MeshFormat::kPly, head + strips + "\n"},
          {"ply_trailing", MeshFormat::kPly, binary + "tail"}};
}

std::vector<SampleFile> stl_dialects(const Mesh& mesh) {
  const std::string text = stl_ascii_file(mesh), binary = stl_binary_file(mesh);
  return {{"stl_crlf", MeshFormat::kStl, changed(text, "\n", "\r\n")},
          {"stl_capitals", MeshFormat::kStl, changed(changed(text, "facet", "FACET"), "vertex", "VERTEX")},
          {"stl_mark", MeshFormat::kStl, "\xef\xbb\xbf" + text},
          {"stl_two_solids", MeshFormat::kStl, text + "solid empty\nendsolid\n"},
          {"stl_cr", MeshFormat::kStl, changed(text, "\n", "\r")},
          {"stl_one_line", MeshFormat::kStl, changed(text, "\n", " ")},
          {"stl_comments", MeshFormat::kStl,
           "; made by hand\n" + changed(text, "    endloop", "  # vertex 1 2 3\nendloop  // end")},
          {"stl_nan_normals", MeshFormat::kStl, changed(text, "normal 0 0 0", "normal\tnan -nan(ind) 1.#QNAN")},
          {"stl_solid_head", MeshFormat::kStl, stl_binary_file(mesh, "solid but binary")},
          {"stl_count_of_0", MeshFormat::kStl, binary.substr(0, 80) + std::string(4, '\0') + binary.substr(84)}};
}

/// The positions between numbers of another attribute.
GltfSample interleaved(const Mesh& mesh) {
  GltfSample sample = gltf_sample(mesh);
  std::string data;
  for (const Vec3& position : mesh.positions) {
    append_floats(data, position);
    append(data, 1.5F);
  }
  sample.primitive()["attributes"]["POSITION"] = sample.add(data, 5126, "VEC3", mesh.positions.size());
  sample.json["bufferViews"].back()["byteStride"] = 16;
  return sample;
}

GltfSample indexless(const Mesh& mesh) {
  GltfSample sample = gltf_sample(mesh);
  std::vector<Vec3> soup;
  for (const Triangle& triangle : mesh.triangles) {
    for (const Index corner : triangle) soup.push_back(mesh.positions[corner]);
  }
  sample.primitive()["attributes"]["POSITION"] = sample.add_positions(soup);
  sample.primitive().erase("indices");
  return sample;
}

/// Every face as a primitive of its own, in turn a strip, a fan, and triangles.
GltfSample primitives(const Mesh& mesh) {
  GltfSample sample = gltf_sample(mesh);
  sample.json["meshes"][0]["primitives"].clear();
  for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
    const Triangle& triangle = mesh.triangles[face];
    std::vector<std::uint32_t> corners(triangle.begin(), triangle.end());
    // Triangles of a fan end with its first vertex.
    if (face % 3 == 2) std::rotate(corners.begin(), corners.end() - 1, corners.end());
    sample.json["meshes"][0]["primitives"].push_back(
        {{"attributes", {{"POSITION", 0}}}, {"mode", 4 + face % 3}, {"indices", sample.add_scalars(corners, 5125)}});
  }
  return sample;
}

/// Halves the positions, and doubles them again by the transform of the node.
GltfSample scaled(const Mesh& mesh) {
  Mesh half = mesh;
  for (Vec3& position : half.positions) position /= 2;
  GltfSample sample = gltf_sample(half);
  sample.json["nodes"] =
      nlohmann::json::parse(R"([{"children": [1], "scale": [4, 4, 4]}, {"mesh": 0, "scale": [0.5, 0.5, 0.5]}])");
  return sample;
}

/// The same, by the one copy of an instanced mesh.
GltfSample scaled_copy(const Mesh& mesh) {
  GltfSample sample = scaled(mesh);
  nlohmann::json& node = sample.json["nodes"][1];
  node.erase("scale");
  node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] = sample.add_positions({{0.5, 0.5, 0.5}});
  return sample;
}

std::vector<SampleFile> gltf_dialects(const Mesh& mesh) {
  return {{"glb_interleaved", MeshFormat::kGlb, interleaved(mesh).glb()},
          {"glb_without_indices", MeshFormat::kGlb, indexless(mesh).glb()},
          {"glb_primitives", MeshFormat::kGlb, primitives(mesh).glb()},
          {"glb_scaled", MeshFormat::kGlb, scaled(mesh).glb()},
          {"glb_scaled_copy", MeshFormat::kGlb, scaled_copy(mesh).glb()},
          {"gltf_interleaved", MeshFormat::kGltf, interleaved(mesh).gltf()}};
}

std::vector<SampleFile> all_dialects(const Mesh& mesh) {
  std::vector<SampleFile> files = sample_files(mesh);
  for (const auto& more :
       {obj_dialects(mesh), off_dialects(mesh), ply_dialects(mesh), stl_dialects(mesh), gltf_dialects(mesh)}) {
    files.insert(files.end(), more.begin(), more.end());
  }
  return files;
}

JobOutput smoothed(const CheckedInput& input) {
  RunContext context;
  return run_job(input, {MrfOptions{}, 1, 0}, context);
}

TEST(Dialects, TheSameMeshGivesTheSameResult) {
  const Mesh mesh = plain_part();
  const LabelledMesh expected = smoothed(check_mesh(mesh)).result;
  for (const SampleFile& file : all_dialects(mesh)) {
    SCOPED_TRACE(file.name);
    const CheckedInput input = check_input(file.bytes, file.format);
    const LabelledMesh found = smoothed(input).result;
    ASSERT_EQ(found.mesh.triangles.size(), mesh.triangles.size());
    std::size_t differing = 0;
    for (std::size_t i = 0; i < 3 * mesh.triangles.size(); ++i) {
      const Vec3& here = found.mesh.positions[found.mesh.triangles[i / 3][i % 3]];
      differing += here == expected.mesh.positions[mesh.triangles[i / 3][i % 3]] ? 0 : 1;
    }
    EXPECT_EQ(differing, 0U);
    EXPECT_NO_THROW(encode_original(file.bytes, input.format, found));
  }
}

TEST(Dialects, TheOriginalOfEveryDialectHasTheResult) {
  const Mesh mesh = plain_part();
  const Mesh after = in_single_precision(add_noise(mesh, 0.2, 3, NoiseKind::kGaussian));
  for (const SampleFile& file : all_dialects(mesh)) {
    SCOPED_TRACE(file.name);
    CheckedInput input = check_input(file.bytes, file.format);
    LabelledMesh result{input.mesh, input.topology.edges, std::vector<double>(input.topology.edges.size(), 0), {}};
    for (std::size_t i = 0; i < 3 * mesh.triangles.size(); ++i) {
      result.mesh.positions[input.mesh.triangles[i / 3][i % 3]] = after.positions[mesh.triangles[i / 3][i % 3]];
    }
    const DecodedMesh read = decode_mesh(encode_original(file.bytes, input.format, result), input.format);
    EXPECT_EQ(read.mesh.positions, result.mesh.positions);
    EXPECT_EQ(read.mesh.triangles, result.mesh.triangles);
  }
}

}  // namespace
}  // namespace crease::test
