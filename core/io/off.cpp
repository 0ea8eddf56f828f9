#include "core/io/off.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "core/base/text.h"
#include "core/io/corner_normals.h"
#include "core/io/mesh_builder.h"
#include "core/io/text_cursor.h"
#include "core/io/text_patch.h"
#include "core/io/write_number.h"
#include "core/io/write_text.h"

namespace crease {
namespace {

constexpr std::size_t kLeastVertexBytes = 6;  // "0 0 0\n"
constexpr std::size_t kLeastFaceBytes = 2;    // "0\n"

/// The keyword OFF in a word: it may follow ST (texture), C (colour) and N (normal), and a number may follow it.
struct Keyword {
  bool found = false;
  bool has_other_dimensions = false;
  bool has_normals = false;
  std::size_t length = 0;
};

Keyword keyword_of(std::string_view word) {
  const std::string lower_word = lower(word);
  const std::size_t at = lower_word.find("off");
  if (at == std::string::npos) return {};
  const std::string_view prefix(lower_word.data(), at);
  const std::string_view rest = word.substr(at + 3);
  if (prefix.find_first_not_of("stcn4") != std::string_view::npos) return {};
  if (rest.find_first_not_of("0123456789") != std::string_view::npos) return {};
  const bool n_dimensions = word.substr(0, at).ends_with('n') && word.substr(at).starts_with("OFF");
  return {true, n_dimensions || prefix.find('4') != std::string_view::npos, prefix.find('n') != std::string_view::npos,
          at + 3};
}

/// Skips the keyword if there is one. The columns of what it announces stand after the position.
Keyword read_keyword(TextCursor& cursor) {
  TextCursor ahead = cursor;
  const std::string_view word = ahead.word();
  const Keyword keyword = keyword_of(word);
  if (!keyword.found) {
    if (lower(word).ends_with("off")) {
      cursor.fail(code::kMeshSyntax, "expected the keyword OFF, found '" + printable(word) + "'");
    }
    return keyword;
  }
  if (keyword.has_other_dimensions) cursor.fail(code::kMeshUnsupported, "only OFF with 3 dimensions is supported");
  if (keyword.length == word.size()) {
    cursor = ahead;
    if (lower(ahead.word()) == "binary") cursor.fail(code::kMeshUnsupported, "binary OFF is not supported");
  } else {
    cursor.return_into(word, keyword.length);
  }
  return keyword;
}

struct Counts {
  std::size_t vertices = 0, faces = 0;
  std::string place;
};

/// Reads the counts of vertices, faces and edges, on one line or several. The last may be missing at the end of a line
/// that has the other two.
Counts read_counts(TextCursor& cursor) {
  Counts counts;
  if (!cursor.skip_to_word()) cursor.fail_expected("the number of vertices");
  counts.vertices = cursor.count("the number of vertices");
  counts.faces = cursor.count_on_any_line("the number of faces");
  counts.place = cursor.place();
  if (!cursor.at_line_end()) {
    cursor.skip_line();
    return counts;
  }
  cursor.skip_to_word();
  TextCursor ahead = cursor;
  const std::string_view edges = ahead.word();
  if (!edges.empty() && edges.find_first_not_of("0123456789") == std::string_view::npos && ahead.at_line_end()) {
    cursor = ahead;
    cursor.skip_line();
  }
  return counts;
}

/// Numbers behind the positions or the corners of a file: colours of three or four numbers from 0 to 1, or, if there is
/// any larger one in the file, to 255.
class OffColours {
 public:
  explicit OffColours(std::size_t expected) : expected_(expected) {}

  /// Reads the rest of a line, of which `before` other numbers come first.
  void read(TextCursor& cursor, std::size_t before) {
    Colour colour{0, 0, 0, kNoOpacity};
    std::size_t count = 0;
    for (; before > 0 && !cursor.at_line_end(); --before) cursor.word();
    for (; !cursor.at_line_end(); ++count) {
      const double value = number_of(cursor.word());
      if (count >= colour.size() || !(value >= 0 && value <= kMost)) return fail();
      colour[count] = static_cast<float>(value);
      largest_ = std::max(largest_, value);
    }
    if (count == 0) return;
    if (count < 3) return fail();
    colours_.push_back(colour);
  }

  /// The colours if every vertex or face has one; otherwise what the numbers are is dropped as `name`.
  std::vector<Colour> finish(MeshBuilder& builder, std::string_view name) {
    if (odd_ || (!colours_.empty() && colours_.size() != expected_)) {
      builder.drop(name);
      return {};
    }
    const float scale = largest_ > 1 ? 255.0F : 1.0F;
    for (Colour& colour : colours_) {
      for (float& value : colour) value /= scale;
      if (colour[3] < 0) colour[3] = 1;
    }
    return std::move(colours_);
  }

 private:
  static constexpr float kNoOpacity = -1;
  static constexpr double kMost = 255;

  void fail() { odd_ = true; }

  std::size_t expected_;
  std::vector<Colour> colours_;
  double largest_ = 0;
  bool odd_ = false;
};

void read_vertices(TextCursor& cursor, MeshBuilder& builder, std::size_t count, bool has_normals) {
  OffColours colours(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (!cursor.skip_to_word()) cursor.fail_expected("a vertex");
    const std::size_t line = cursor.line();
    const double x = cursor.number_on_any_line("x");
    const double y = cursor.number_on_any_line("y");
    const double z = cursor.number_on_any_line("z");
    if (cursor.line() != line && !cursor.at_line_end()) {
      cursor.fail(code::kMeshSyntax, "the line goes on behind a vertex that began on an earlier line");
    }
    builder.add_vertex(x, y, z, [&] { return cursor.place(); });
    if (!cursor.at_line_end()) colours.read(cursor, has_normals ? 3 : 0);
    cursor.skip_line();
  }
  builder.appearance().colours.values = colours.finish(builder, "vertex colours or other numbers behind positions");
  builder.appearance().has_normals = has_normals;
}

void read_faces(TextCursor& cursor, MeshBuilder& builder, std::size_t count) {
  std::vector<Index> corners;
  OffColours colours(count);
  std::vector<std::size_t> ends;  // of the triangles of each face, once one has a colour
  for (std::size_t i = 0; i < count; ++i) {
    if (!cursor.skip_to_word()) cursor.fail_expected("a face");
    const std::size_t size = cursor.count("the number of corners");
    corners.clear();
    for (std::size_t k = 0; k < size; ++k) {
      corners.push_back(builder.checked_index(cursor.integer("a vertex index"), builder.vertices()));
    }
    builder.add_face(corners, [&] { return cursor.place(); });
    if (!cursor.at_line_end()) {
      colours.read(cursor, 0);
      ends.push_back(builder.mesh().triangles.size());
    }
    cursor.skip_line();
  }
  const std::vector<Colour> of_faces = colours.finish(builder, "face colours");
  for (std::size_t i = 0; i < of_faces.size(); ++i) {
    builder.appearance().face_colours.resize(ends[i], of_faces[i]);
  }
}

void append_colour(std::string& text, const Colour& colour) {
  for (const float value : colour) {
    text += ' ';
    append_number(text, static_cast<unsigned>(byte_of(value)));
  }
}

}  // namespace

Likeness looks_like_off(const Sample& sample) {
  return keyword_of(sample.word).found ? Likeness::kText : Likeness::kUnlike;
}

MeshContent read_off(std::string_view bytes, const DecodeLimits& limits) {
  TextCursor cursor(bytes, {.comment = '#'});
  MeshBuilder builder(limits);
  if (!cursor.skip_to_word()) cursor.fail_expected("the keyword OFF");
  const Keyword keyword = read_keyword(cursor);
  const Counts counts = read_counts(cursor);
  const std::size_t rest = cursor.rest() + 1;  // the last line may lack its line end
  builder.expect_vertices(counts.vertices, kLeastVertexBytes, rest, counts.place);
  builder.expect_faces(counts.faces, kLeastFaceBytes, rest - counts.vertices * kLeastVertexBytes, counts.place);
  read_vertices(cursor, builder, counts.vertices, keyword.has_normals);
  read_faces(cursor, builder, counts.faces);
  if (cursor.skip_to_word()) {
    builder.warn("trailing_bytes", "ignored everything after the last face, from " + cursor.place());
  }
  return builder.finish();
}

std::string write_off(const LabelledMesh& result, const nlohmann::ordered_json& /*extras*/,
                      const MeshStyle& /*style*/) {
  const Mesh& mesh = result.mesh;
  const std::vector<Colour> colours = vertex_colours(result.appearance, mesh, false);
  const std::vector<Colour>& of_faces = result.appearance.face_colours;
  std::optional<NormalMeans> normals;
  if (result.appearance.has_normals) normals.emplace(result, mesh.positions.size()).add_vertices();
  std::string text = reserved_text(mesh);
  text += fmt::format("{}{}OFF\n{} {} 0\n", colours.empty() ? "" : "C", normals ? "N" : "", mesh.positions.size(),
                      mesh.triangles.size());
  for (std::size_t vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    append_numbers(text, mesh.positions[vertex]);
    if (normals) {
      text += ' ';
      append_numbers(text, (*normals)[vertex].value_or(Vec3::UnitZ()).cast<float>());
    }
    if (!colours.empty()) append_colour(text, colours[vertex]);
    text += '\n';
  }
  if (of_faces.empty()) {
    append_faces(text, mesh.triangles, "3 ", 0);
  } else {
    for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
      append_faces(text, {&mesh.triangles[face], 1}, "3 ", 0);
      text.pop_back();
      append_colour(text, of_faces[face]);
      text += '\n';
    }
  }
  return text;
}

std::string patch_off(std::string_view upload, const LabelledMesh& result) {
  TextCursor cursor(upload, {.comment = '#'});
  cursor.skip_to_word();
  std::optional<NormalMeans> normals;
  if (read_keyword(cursor).has_normals) {
    normals.emplace(result, result.mesh.positions.size());
    normals->add_vertices();
  }
  require_vertices(read_counts(cursor).vertices, result.mesh);
  TextPatch patch(upload);
  for (std::size_t vertex = 0; vertex < result.mesh.positions.size(); ++vertex) {
    patch.replace_next(cursor, result.mesh.positions[vertex]);
    const std::optional<Vec3> normal = normals ? (*normals)[vertex] : std::nullopt;
    if (normal && !cursor.at_line_end()) patch.replace_next(cursor, *normal);
    cursor.skip_line();
  }
  return patch.finish();
}

}  // namespace crease
