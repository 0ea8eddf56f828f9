#include "core/io/off.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
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
  bool has_normals = false, has_colours = false, has_texture = false;
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
  const auto has = [&](char letter) { return prefix.find(letter) != std::string_view::npos; };
  return {true, n_dimensions || has('4'), has('n'), has('c'), has('s'), at + 3};
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
  std::size_t last_line = 0;
};

/// Reads the counts of vertices, faces and edges, on one line or several. The last may be missing at the end of a line
/// that has the other two.
Counts read_counts(TextCursor& cursor) {
  Counts counts;
  if (!cursor.skip_to_word()) cursor.fail_expected("the number of vertices");
  counts.vertices = cursor.count("the number of vertices");
  counts.faces = cursor.count_on_any_line("the number of faces");
  counts.place = cursor.place();
  counts.last_line = cursor.line();
  if (!cursor.at_line_end()) {
    cursor.word();
    return counts;
  }
  cursor.skip_to_word();
  TextCursor ahead = cursor;
  const std::string_view edges = ahead.word();
  if (!edges.empty() && edges.find_first_not_of("0123456789") == std::string_view::npos && ahead.at_line_end()) {
    cursor = ahead;
    counts.last_line = cursor.line();
  }
  return counts;
}

/// Where vertices and faces end: with their line or, in files that have several of them on a line, after so many words
/// behind their positions or corners.
struct Layout {
  std::optional<std::size_t> behind_position{}, behind_corners{};

  bool by_lines() const { return !behind_position; }
};

void skip_counts(TextCursor& cursor, const Counts& counts, const Layout& layout) {
  if (layout.by_lines() && cursor.line() == counts.last_line) cursor.skip_line();
}

bool skip_words(TextCursor& cursor, std::size_t count, bool on_any_line) {
  for (; count > 0; --count) {
    if (on_any_line ? !cursor.skip_to_word() : cursor.at_line_end()) return false;
    cursor.word();
  }
  return true;
}

/// Skips what stands behind a position or the corners of a face. Returns false if the file ends before.
bool skip_behind(TextCursor& cursor, const std::optional<std::size_t>& words) {
  if (words) return skip_words(cursor, *words, true);
  cursor.skip_line();
  return true;
}

bool skip_vertex(TextCursor& cursor, const Layout& layout) {
  cursor.skip_to_word();
  const std::size_t line = cursor.line();
  if (!skip_words(cursor, 3, true)) return false;
  if (layout.by_lines() && cursor.line() != line && !cursor.at_line_end()) return false;
  return skip_behind(cursor, layout.behind_position);
}

/// Skips a face. Returns false if there is none whose corners are all below `vertices`. Without lines, a face of fewer
/// than three corners tells that the words are read as what they are not.
bool skip_face(TextCursor& cursor, const Layout& layout, double vertices) {
  if (!cursor.skip_to_word()) return false;
  const auto is_below = [](double number, double limit) {
    return number >= 0 && number < limit && number == std::floor(number);
  };
  const double size = number_of(cursor.word());
  if (!is_below(size, static_cast<double>(cursor.rest() + 1)) || (!layout.by_lines() && size < 3)) return false;
  for (auto left = static_cast<std::size_t>(size); left > 0; --left) {
    if (layout.by_lines() ? cursor.at_line_end() : !cursor.skip_to_word()) return false;
    if (!is_below(number_of(cursor.word()), vertices)) return false;
  }
  return skip_behind(cursor, layout.behind_corners);
}

/// Whether the layout takes all words of the file, with corners below `vertices`.
bool fits(TextCursor cursor, const Counts& counts, const Layout& layout, double vertices) {
  skip_counts(cursor, counts, layout);
  for (std::size_t i = 0; i < counts.vertices; ++i) {
    if (!skip_vertex(cursor, layout)) return false;
  }
  for (std::size_t i = 0; i < counts.faces; ++i) {
    if (!skip_face(cursor, layout, vertices)) return false;
  }
  return layout.by_lines() || !cursor.skip_to_word();
}

/// Those that files without lines may have, the likely ones first: colours are three or four numbers, and those of
/// faces may be the number of one.
std::vector<Layout> layouts_without_lines(const Keyword& keyword) {
  const std::size_t others = (keyword.has_normals ? 3 : 0) + (keyword.has_texture ? 2 : 0);
  std::vector<Layout> layouts;
  for (const std::size_t colour :
       keyword.has_colours ? std::vector<std::size_t>{4, 3} : std::vector<std::size_t>{0, 3, 4}) {
    for (const std::size_t of_face : {0U, 3U, 4U, 1U}) layouts.push_back({others + colour, of_face});
  }
  return layouts;
}

/// How a file is laid out whose counts end at the cursor. By lines if no other layout takes all of its words. One with
/// corners that do not exist is the last resort, so that these are what the reader complains about.
Layout layout_of(const TextCursor& cursor, const Keyword& keyword, const Counts& counts) {
  constexpr double kAny = std::numeric_limits<double>::infinity();
  if (fits(cursor, counts, {}, kAny)) return {};
  for (const double vertices : {static_cast<double>(counts.vertices), kAny}) {
    for (const Layout& layout : layouts_without_lines(keyword)) {
      if (fits(cursor, counts, layout, vertices)) return layout;
    }
  }
  return {};
}

/// Numbers behind the positions or the corners of a file: colours of three or four numbers from 0 to 1, or, if there is
/// any larger one in the file, to 255.
class OffColours {
 public:
  explicit OffColours(std::size_t expected) : expected_(expected) {}

  /// Reads the rest of a line, or so many words, of which `before` other numbers come first. Returns whether there is
  /// any.
  bool read(TextCursor& cursor, const std::optional<std::size_t>& words, std::size_t before) {
    Colour colour{0, 0, 0, kNoOpacity};
    std::size_t count = 0;
    for (; words ? count < *words && cursor.skip_to_word() : !cursor.at_line_end(); ++count) {
      const std::string_view word = cursor.word();
      if (count >= before) set(colour, count - before, number_of(word));
    }
    if (!words) cursor.skip_line();
    if (count > before) colours_.push_back(colour);
    odd_ = odd_ || (count > before && count < before + 3);
    return count > 0;
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

  void set(Colour& colour, std::size_t place, double value) {
    if (place >= colour.size() || !(value >= 0 && value <= kMost)) {
      odd_ = true;
      return;
    }
    colour[place] = static_cast<float>(value);
    largest_ = std::max(largest_, value);
  }

  std::size_t expected_;
  std::vector<Colour> colours_;
  double largest_ = 0;
  bool odd_ = false;
};

class OffReader {
 public:
  OffReader(std::string_view bytes, const DecodeLimits& limits) : cursor_(bytes, {.comment = '#'}), builder_(limits) {
    if (!cursor_.skip_to_word()) cursor_.fail_expected("the keyword OFF");
    keyword_ = read_keyword(cursor_);
    counts_ = read_counts(cursor_);
  }

  Layout layout() const { return layout_of(cursor_, keyword_, counts_); }

  MeshContent read(const Layout& layout) {
    layout_ = layout;
    skip_counts(cursor_, counts_, layout);
    const std::size_t rest = cursor_.rest() + 1;  // the last line may lack its line end
    builder_.expect_vertices(counts_.vertices, kLeastVertexBytes, rest, counts_.place);
    builder_.expect_faces(counts_.faces, kLeastFaceBytes, rest - counts_.vertices * kLeastVertexBytes, counts_.place);
    read_vertices();
    read_faces();
    if (cursor_.skip_to_word()) {
      builder_.warn("trailing_bytes", "ignored everything after the last face, from " + cursor_.place());
    }
    return builder_.finish();
  }

 private:
  void read_vertices() {
    OffColours colours(counts_.vertices);
    for (std::size_t i = 0; i < counts_.vertices; ++i) {
      if (!cursor_.skip_to_word()) cursor_.fail_expected("a vertex");
      const std::size_t line = cursor_.line();
      const double x = cursor_.number_on_any_line("x");
      const double y = cursor_.number_on_any_line("y");
      const double z = cursor_.number_on_any_line("z");
      if (layout_.by_lines() && cursor_.line() != line && !cursor_.at_line_end()) {
        cursor_.fail(code::kMeshSyntax, "the line goes on behind a vertex that began on an earlier line");
      }
      builder_.add_vertex(x, y, z, [&] { return cursor_.place(); });
      read_behind(colours, layout_.behind_position, keyword_.has_normals ? 3 : 0);
    }
    builder_.appearance().colours.values = colours.finish(builder_, "vertex colours or other numbers behind positions");
    builder_.appearance().has_normals = keyword_.has_normals;
  }

  void read_faces() {
    std::vector<Index> corners;
    OffColours colours(counts_.faces);
    std::vector<std::size_t> ends;  // of the triangles of each face, once one has a colour
    for (std::size_t i = 0; i < counts_.faces; ++i) {
      if (!cursor_.skip_to_word()) cursor_.fail_expected("a face");
      const std::size_t size = cursor_.count("the number of corners");
      corners.clear();
      for (std::size_t k = 0; k < size; ++k) corners.push_back(read_corner());
      builder_.add_face(corners, [&] { return cursor_.place(); });
      if (read_behind(colours, layout_.behind_corners, 0)) ends.push_back(builder_.mesh().triangles.size());
    }
    const std::vector<Colour> of_faces = colours.finish(builder_, "face colours");
    for (std::size_t i = 0; i < of_faces.size(); ++i) {
      builder_.appearance().face_colours.resize(ends[i], of_faces[i]);
    }
  }

  Index read_corner() {
    if (!layout_.by_lines()) cursor_.skip_to_word();
    return builder_.checked_index(cursor_.integer("a vertex index"), builder_.vertices());
  }

  /// Reads what stands behind a position or the corners of a face. Returns whether there is anything.
  bool read_behind(OffColours& colours, const std::optional<std::size_t>& words, std::size_t before) {
    if (words || !cursor_.at_line_end()) return colours.read(cursor_, words, before);
    cursor_.skip_line();
    return false;
  }

  TextCursor cursor_;
  MeshBuilder builder_;
  Keyword keyword_;
  Counts counts_;
  Layout layout_;
};

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

/// Files are taken to have a line for each vertex and face until that does not work out.
MeshContent read_off(std::string_view bytes, const DecodeLimits& limits) {
  try {
    return OffReader(bytes, limits).read({});
  } catch (const Error&) {
    OffReader reader(bytes, limits);
    const Layout layout = reader.layout();
    if (layout.by_lines()) throw;
    return reader.read(layout);
  }
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
  const Keyword keyword = read_keyword(cursor);
  if (keyword.has_normals) {
    normals.emplace(result, result.mesh.positions.size());
    normals->add_vertices();
  }
  const Counts counts = read_counts(cursor);
  require_vertices(counts.vertices, result.mesh);
  const Layout layout = layout_of(cursor, keyword, counts);
  skip_counts(cursor, counts, layout);
  TextPatch patch(upload);
  for (std::size_t vertex = 0; vertex < result.mesh.positions.size(); ++vertex) {
    patch.replace_next(cursor, result.mesh.positions[vertex]);
    TextCursor behind = cursor;
    skip_behind(behind, layout.behind_position);
    const std::optional<Vec3> normal = normals ? (*normals)[vertex] : std::nullopt;
    if (normal && !(layout.by_lines() && cursor.at_line_end())) patch.replace_next(cursor, *normal);
    cursor = behind;
  }
  return patch.finish();
}

}  // namespace crease
