#include "core/io/off.h"

#include <fmt/format.h>

#include "core/base/text.h"
#include "core/io/mesh_builder.h"
#include "core/io/text_cursor.h"
#include "core/io/write_text.h"

namespace crease {
namespace {

constexpr std::size_t kLeastVertexBytes = 6;  // "0 0 0\n"
constexpr std::size_t kLeastFaceBytes = 8;    // "3 0 0 0\n"

/// Skips the keyword if there is one: OFF, which may follow ST (texture), C (colour) and N (normal). The columns of
/// these stand after the position.
void read_keyword(TextCursor& cursor) {
  TextCursor ahead = cursor;
  std::string_view word = ahead.word();
  if (!word.ends_with("OFF")) return;
  const std::string_view extras = word.substr(0, word.size() - 3);
  if (extras.find_first_of("4n") != std::string_view::npos) {
    cursor.fail(code::kMeshUnsupported, "only OFF with 3 dimensions is supported");
  }
  if (extras.find_first_not_of("STCN") != std::string_view::npos) {
    cursor.fail(code::kMeshSyntax, "expected the keyword OFF, found '" + printable(word) + "'");
  }
  cursor = ahead;
  if (ahead.word() == "BINARY") cursor.fail(code::kMeshUnsupported, "binary OFF is not supported");
}

void read_vertices(TextCursor& cursor, MeshBuilder& builder, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    if (!cursor.skip_to_word()) cursor.fail_expected("a vertex");
    const double x = cursor.number("x");
    const double y = cursor.number("y");
    const double z = cursor.number("z");
    builder.add_vertex(x, y, z, [&] { return cursor.place(); });
    cursor.skip_line();
  }
}

void read_faces(TextCursor& cursor, MeshBuilder& builder, std::size_t count) {
  std::vector<Index> corners;
  for (std::size_t i = 0; i < count; ++i) {
    if (!cursor.skip_to_word()) cursor.fail_expected("a face");
    const std::size_t size = cursor.count("the number of corners");
    corners.clear();
    for (std::size_t k = 0; k < size; ++k) {
      corners.push_back(builder.checked_index(cursor.integer("a vertex index"), builder.vertices()));
    }
    builder.add_face(corners, [&] { return cursor.place(); });
    cursor.skip_line();
  }
}

}  // namespace

Likeness looks_like_off(const Sample& sample) {
  constexpr std::string_view kOff = "OFF";
  if (!sample.word.ends_with(kOff)) return Likeness::kUnlike;
  const std::string_view prefix = sample.word.substr(0, sample.word.size() - kOff.size());
  return prefix.find_first_not_of("STCN4n") == std::string_view::npos ? Likeness::kText : Likeness::kUnlike;
}

MeshContent read_off(std::string_view bytes, const DecodeLimits& limits) {
  TextCursor cursor(bytes, {.comment = '#'});
  MeshBuilder builder(limits);
  if (!cursor.skip_to_word()) cursor.fail_expected("the keyword OFF");
  read_keyword(cursor);
  if (!cursor.skip_to_word()) cursor.fail_expected("the number of vertices");
  const std::size_t vertices = cursor.count("the number of vertices");
  const std::size_t faces = cursor.count("the number of faces");
  const std::string place = cursor.place();
  const std::size_t rest = cursor.rest() + 1;  // the last line may lack its line end
  builder.expect_vertices(vertices, kLeastVertexBytes, rest, place);
  builder.expect_faces(faces, kLeastFaceBytes, rest - vertices * kLeastVertexBytes, place);
  cursor.skip_line();
  read_vertices(cursor, builder, vertices);
  read_faces(cursor, builder, faces);
  if (cursor.skip_to_word()) {
    builder.warn("trailing_bytes", "ignored everything after the last face, from " + cursor.place());
  }
  return builder.finish();
}

std::string write_off(const Mesh& mesh) {
  std::string text = reserved_text(mesh);
  text += fmt::format("OFF\n{} {} 0\n", mesh.positions.size(), mesh.triangles.size());
  append_positions(text, mesh, "");
  append_faces(text, mesh, "3 ", 0);
  return text;
}

}  // namespace crease
