#include "core/io/obj.h"

#include <algorithm>
#include <array>
#include <limits>

#include "core/base/text.h"
#include "core/io/mesh_builder.h"
#include "core/io/text_cursor.h"
#include "core/io/write_text.h"

namespace crease {
namespace {

/// A statement that does not describe the shape of the surface, and what it gives.
struct Appearance {
  std::string_view keyword, gives;
};

constexpr std::array<Appearance, 17> kAppearance{{{"vt", "texture coordinates"},
                                                  {"vn", "normals"},
                                                  {"vp", "parameter space vertices"},
                                                  {"g", "groups"},
                                                  {"o", "objects"},
                                                  {"s", "smoothing groups"},
                                                  {"mtllib", "materials"},
                                                  {"usemtl", "materials"},
                                                  {"usemap", "textures"},
                                                  {"maplib", "textures"},
                                                  {"lod", "display attributes"},
                                                  {"bevel", "display attributes"},
                                                  {"c_interp", "display attributes"},
                                                  {"d_interp", "display attributes"},
                                                  {"shadow_obj", "display attributes"},
                                                  {"trace_obj", "display attributes"},
                                                  {"mg", "merging groups"}}};

bool is_index_character(char c) { return (c >= '0' && c <= '9') || c == '/' || c == '-'; }

class ObjReader {
 public:
  ObjReader(std::string_view bytes, const DecodeLimits& limits)
      : cursor_(bytes, {.comment = '#', .backslash = true}), builder_(limits) {}

  MeshContent read() {
    while (cursor_.skip_to_word()) {
      read_statement(cursor_.word());
      cursor_.skip_line();
    }
    check_forward_faces();
    warn_of_skipped();
    return builder_.finish();
  }

 private:
  /// A face that uses a vertex before its definition.
  struct ForwardFace {
    std::size_t face;
    std::size_t line;
    std::int64_t largest;  ///< counted from 0
  };

  void read_statement(std::string_view keyword) {
    if (keyword == "v") {
      read_vertex();
    } else if (keyword == "f") {
      read_face();
    } else if (keyword == "l") {
      ++lines_;
    } else if (keyword == "p") {
      ++points_;
    } else {
      note_appearance(keyword);
    }
  }

  void note_appearance(std::string_view keyword) {
    const auto known = std::ranges::find(kAppearance, keyword, &Appearance::keyword);
    if (known == kAppearance.end()) {
      if (unknown_++ == 0) first_unknown_ = printable(keyword);
    } else if (bool& noted = noted_[static_cast<std::size_t>(known - kAppearance.begin())]; !noted) {
      noted = true;
      builder_.drop(known->gives);
    }
  }

  void read_vertex() {
    const double x = cursor_.number("x");
    const double y = cursor_.number("y");
    const double z = cursor_.number("z");
    builder_.add_vertex(x, y, z, [&] { return cursor_.place(); });
    if (has_columns_ || cursor_.at_line_end()) return;
    has_columns_ = true;
    builder_.drop("vertex colours or other numbers behind positions");
  }

  void read_face() {
    corners_.clear();
    std::int64_t largest = -1;
    while (!cursor_.at_line_end()) {
      const std::int64_t index = read_corner();
      largest = std::max(largest, index);
      corners_.push_back(static_cast<Index>(index));
    }
    if (largest >= static_cast<std::int64_t>(builder_.vertices())) {
      forward_.push_back({builder_.faces(), cursor_.line(), largest});
    }
    builder_.add_face(corners_, [&] { return cursor_.place(); });
  }

  /// Reads v, v/vt, v//vn or v/vt/vn. v counts from 1, or backwards from -1 for the last vertex so far. Returns the
  /// vertex counted from 0.
  std::int64_t read_corner() {
    std::int64_t index = 0;
    if (!cursor_.leading_integer(index) || !cursor_.skip_word_of(is_index_character)) {
      cursor_.fail(code::kMeshSyntax, "expected v, v/vt, v//vn or v/vt/vn, found '" + printable(cursor_.word()) + "'");
    }
    const auto vertices = static_cast<std::int64_t>(builder_.vertices());
    if (index == 0 || index < -vertices || index > std::int64_t{kNone}) fail_index(index, builder_.face_place());
    return index > 0 ? index - 1 : vertices + index;
  }

  void check_forward_faces() const {
    for (const ForwardFace& forward : forward_) {
      if (forward.largest < static_cast<std::int64_t>(builder_.vertices())) continue;
      throw Error(code::kMeshIndexOutOfRange,
                  fmt::format("line {} uses vertex {}, but the file has {}", forward.line, forward.largest + 1,
                              counted(builder_.vertices(), "vertex", "vertices")),
                  fmt::format("face {}", forward.face));
    }
  }

  [[noreturn]] void fail_index(std::int64_t index, const std::string& place) const {
    throw Error(code::kMeshIndexOutOfRange,
                fmt::format("line {} uses vertex {}; valid are 1 and up, or -1 to -{} for the vertices so far",
                            cursor_.line(), index, builder_.vertices()),
                place);
  }

  void warn_of_skipped() {
    if (lines_ + points_ != 0) {
      builder_.warn("elements_skipped", fmt::format("skipped {} and {}: only faces are read",
                                                    counted(lines_, "line element", "line elements"),
                                                    counted(points_, "point element", "point elements")));
    }
    if (unknown_ != 0) {
      builder_.warn("statements_skipped", fmt::format("skipped {} of unknown kinds; the first is '{}'",
                                                      counted(unknown_, "statement", "statements"), first_unknown_));
    }
  }

  TextCursor cursor_;
  MeshBuilder builder_;
  std::vector<Index> corners_;
  std::vector<ForwardFace> forward_;
  std::size_t lines_ = 0, points_ = 0, unknown_ = 0;
  std::string first_unknown_;
  std::array<bool, kAppearance.size()> noted_{};
  bool has_columns_ = false;
};

}  // namespace

Likeness looks_like_obj(const Sample& sample) {
  constexpr std::array<std::string_view, 13> kKeywords{"v", "vt", "vn", "vp", "f",      "o",     "g",
                                                       "s", "l",  "p",  "mg", "mtllib", "usemtl"};
  return std::find(kKeywords.begin(), kKeywords.end(), sample.word) == kKeywords.end() ? Likeness::kUnlike
                                                                                       : Likeness::kText;
}

MeshContent read_obj(std::string_view bytes, const DecodeLimits& limits) { return ObjReader(bytes, limits).read(); }

std::string write_obj(const Mesh& mesh) {
  std::string text = reserved_text(mesh);
  append_positions(text, mesh, "v ");
  append_faces(text, mesh, "f ", 1);
  return text;
}

std::string write_obj_with_ridges(const LabelledMesh& result) {
  std::string text = write_obj(result.mesh);
  for (std::size_t edge = 0; edge < result.edges.size(); ++edge) {
    if (!is_ridge(result.labels[edge])) continue;
    text += fmt::format("l {} {}\n", result.edges[edge].v0 + 1, result.edges[edge].v1 + 1);
  }
  return text;
}

}  // namespace crease
