#include "core/io/obj.h"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>

#include "core/base/text.h"
#include "core/io/mesh_builder.h"
#include "core/io/text_cursor.h"
#include "core/io/write_gltf_corners.h"
#include "core/io/write_number.h"
#include "core/io/write_text.h"

namespace crease {
namespace {

/// A statement that only the original keeps, and what it gives.
struct Skipped {
  std::string_view keyword, gives;
};

constexpr std::array<Skipped, 13> kSkipped{{{"vp", "parameter space vertices"},
                                            {"g", "groups"},
                                            {"o", "objects"},
                                            {"s", "smoothing groups"},
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
    check_colours();
    check_texture();
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

  struct Unread {
    std::string keyword;
    std::size_t count;
  };

  void read_statement(std::string_view keyword) {
    if (keyword.size() == 1) return read_short_statement(keyword);
    if (keyword == "vt") {
      read_texture();
    } else if (keyword == "vn") {
      builder_.appearance().has_normals = true;
    } else if (keyword == "usemtl") {
      builder_.start_material(material(valid_utf8(cursor_.rest_of_line())));
    } else if (keyword == "mtllib") {
      builder_.appearance().material_libraries.push_back(valid_utf8(cursor_.rest_of_line()));
    } else {
      skip(keyword);
    }
  }

  /// Nearly all statements are of one letter.
  void read_short_statement(std::string_view keyword) {
    switch (keyword.front()) {
      case 'v':
        return read_vertex();
      case 'f':
        return read_face();
      case 'l':
        ++lines_;
        return;
      case 'p':
        ++points_;
        return;
      default:
        skip(keyword);
    }
  }

  void skip(std::string_view keyword) {
    const auto known = std::ranges::find(kSkipped, keyword, &Skipped::keyword);
    if (known == kSkipped.end()) {
      count_unread(printable(keyword));
    } else if (bool& noted = noted_[static_cast<std::size_t>(known - kSkipped.begin())]; !noted) {
      noted = true;
      builder_.drop(known->gives);
    }
  }

  /// Counts a kind of statement that is not read. Those beyond the first kinds are counted together.
  void count_unread(std::string keyword) {
    constexpr std::size_t kMostKinds = 20;
    auto known = std::ranges::find(unread_, keyword, &Unread::keyword);
    if (known == unread_.end() && unread_.size() == kMostKinds) {
      ++further_unread_;
      return;
    }
    if (known == unread_.end()) known = unread_.insert(known, {std::move(keyword), 0});
    ++known->count;
  }

  void read_vertex() {
    const double x = cursor_.number("x");
    const double y = cursor_.number("y");
    const double z = cursor_.number("z");
    builder_.add_vertex(x, y, z, [&] { return cursor_.place(); });
    if (!cursor_.at_line_end()) read_columns();
  }

  /// Reads what stands behind a position: three numbers are a colour, and a fourth its opacity. Others have no meaning
  /// here.
  void read_columns() {
    Colour colour{1, 1, 1, 1};
    std::size_t count = 0;
    bool in_range = true;
    for (; !cursor_.at_line_end(); ++count) {
      const double value = number_of(cursor_.word());
      in_range = in_range && value >= 0 && value <= 1;
      if (count < colour.size()) colour[count] = static_cast<float>(value);
    }
    std::vector<Colour>& colours = builder_.appearance().colours.values;
    if ((count == 3 || count == 4) && in_range && colours.size() + 1 == builder_.vertices()) {
      colours.push_back(colour);
    } else {
      has_odd_columns_ = true;
      if (count == 1 && colour[0] != 1) ++fourths_;
    }
  }

  void read_texture() {
    const double u = cursor_.number("u");
    const double v = cursor_.at_line_end() ? 0 : cursor_.number("v");
    if (!cursor_.at_line_end() && cursor_.number("w") != 0) builder_.drop("third texture coordinates");
    std::vector<CornerValues<2>>& texture = builder_.appearance().texture;
    if (texture.empty()) texture.emplace_back();
    texture.front().values.push_back({static_cast<float>(u), static_cast<float>(v)});
  }

  Index material(const std::string& name) {
    std::vector<Material>& materials = builder_.appearance().materials;
    const auto [known, is_new] = materials_.try_emplace(name, static_cast<Index>(materials.size()));
    if (is_new) materials.push_back({name});
    return known->second;
  }

  void read_face() {
    corners_.clear();
    texture_numbers_.clear();
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
    if (texture_numbers_.empty()) return;
    texture_numbers_.resize(corners_.size(), kNone);
    builder_.add_texture(texture_numbers_);
  }

  /// Reads vt of the next corner, if there is one. Texture coordinates may follow the faces that name them.
  void read_texture_number() {
    std::int64_t number = 0;
    if (!cursor_.leading_integer(number)) return;
    number += number < 0 ? texture_count() : -1;
    texture_numbers_.resize(corners_.size(), kNone);
    texture_numbers_.push_back(number >= 0 && number < std::int64_t{kNone} ? static_cast<Index>(number) : kNone);
    has_odd_numbers_ = has_odd_numbers_ || texture_numbers_.back() == kNone;
  }

  std::int64_t texture_count() {
    const std::vector<CornerValues<2>>& texture = builder_.appearance().texture;
    return texture.empty() ? 0 : static_cast<std::int64_t>(texture.front().values.size());
  }

  /// Reads v, v/vt, v//vn or v/vt/vn. v counts from 1, or backwards from -1 for the last vertex so far. Returns the
  /// vertex counted from 0.
  std::int64_t read_corner() {
    std::int64_t index = 0;
    const bool has_index = cursor_.leading_integer(index);
    if (has_index && cursor_.skip('/')) read_texture_number();
    if (!has_index || !cursor_.skip_word_of(is_index_character)) {
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

  void check_colours() {
    std::vector<Colour>& colours = builder_.appearance().colours.values;
    if (!colours.empty() && colours.size() != builder_.vertices()) has_odd_columns_ = true;
    if (!has_odd_columns_) return;
    colours.clear();
    builder_.drop("vertex colours or other numbers behind positions");
  }

  void check_texture() {
    const auto count = static_cast<Index>(texture_count());
    std::vector<CornerValues<2>>& texture = builder_.appearance().texture;
    if (!texture.empty() && texture.front().corners.empty()) texture.clear();  // no face names any
    for (CornerValues<2>& set : texture) {
      for (Triangle& corners : set.corners) {
        for (Index& number : corners) {
          if (number == kNone || number < count) continue;
          number = kNone;
          has_odd_numbers_ = true;
        }
      }
      if (count == 0) return texture.clear();
    }
    if (has_odd_numbers_) builder_.drop("numbers of texture coordinates that do not exist");
  }

  [[noreturn]] void fail_index(std::int64_t index, const std::string& place) const {
    throw Error(code::kMeshIndexOutOfRange,
                fmt::format("line {} uses vertex {}; valid are 1 and up, or -1 to -{} for the vertices so far",
                            cursor_.line(), index, builder_.vertices()),
                place);
  }

  void warn_of_skipped() {
    if (fourths_ != 0) {
      builder_.warn("fourth_coordinates_ignored",
                    fmt::format("{} a fourth number that is not 1: a weight of free-form surfaces, by which positions "
                                "are not divided",
                                counted(fourths_, "vertex has", "vertices have")));
    }
    std::vector<std::string> elements;
    if (lines_ != 0) elements.push_back(counted(lines_, "line element (l)", "line elements (l)"));
    if (points_ != 0) elements.push_back(counted(points_, "point element (p)", "point elements (p)"));
    if (!elements.empty()) {
      builder_.warn("elements_skipped", fmt::format("skipped {}: only faces are read", fmt::join(elements, " and ")));
    }
    std::vector<std::string> statements;
    for (const auto& [keyword, count] : unread_) statements.push_back(fmt::format("{} '{}'", count, keyword));
    if (further_unread_ != 0) statements.push_back(fmt::format("{} of further kinds", further_unread_));
    if (!statements.empty()) {
      builder_.warn("statements_skipped",
                    fmt::format("skipped statements that are not read: {}", fmt::join(statements, ", ")));
    }
  }

  TextCursor cursor_;
  MeshBuilder builder_;
  std::vector<Index> corners_;
  std::vector<ForwardFace> forward_;
  std::size_t lines_ = 0, points_ = 0, fourths_ = 0;
  std::vector<Unread> unread_;  ///< in the order of the file
  std::size_t further_unread_ = 0;
  std::array<bool, kSkipped.size()> noted_{};
  std::vector<Index> texture_numbers_;  ///< of the corners of the current face
  bool has_odd_columns_ = false, has_odd_numbers_ = false;
  std::map<std::string, Index, std::less<>> materials_;
};

/// Writes the mesh with what OBJ keeps of the look of its upload.
class ObjWriter {
 public:
  explicit ObjWriter(const LabelledMesh& result)
      : result_(result), look_(result.appearance), text_(reserved_text(result.mesh)) {}

  std::string write() {
    for (const std::string& library : look_.material_libraries) text_ += "mtllib " + library + '\n';
    append_positions(text_, result_.mesh, "v ", vertex_colours(look_, result_.mesh, false));
    if (!look_.texture.empty()) {
      for (const auto& [u, v] : texture_of(look_, 0, false)) append_line("vt", std::array{u, v});
    }
    if (look_.has_normals) {
      normals_ = split_along_ridges(result_);
      for (const Vec3& normal : normals_->normals) append_line("vn", normal.cast<float>());
    }
    write_faces();
    return std::move(text_);
  }

 private:
  template <typename Numbers>
  void append_line(std::string_view keyword, const Numbers& numbers) {
    text_ += keyword;
    for (const float number : numbers) {
      text_ += ' ';
      append_number(text_, number);
    }
    text_ += '\n';
  }

  void write_faces() {
    const std::vector<MaterialRun> runs = covering_runs(look_, result_.mesh.triangles.size());
    const bool plain = look_.texture.empty() && !normals_;
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const std::size_t end = i + 1 < runs.size() ? runs[i + 1].first_face : result_.mesh.triangles.size();
      if (runs[i].material != kNone) {
        text_ += "usemtl " + name_of(look_, runs[i].material) + '\n';
      } else if (i > 0) {
        text_ += "usemtl none\n";  // OBJ has no way back to no material
      }
      if (plain) {
        append_faces(text_, {result_.mesh.triangles.data() + runs[i].first_face, end - runs[i].first_face}, "f ", 1);
      } else {
        for (std::size_t face = runs[i].first_face; face < end; ++face) write_face(face);
      }
    }
  }

  void write_face(std::size_t face) {
    const std::vector<Triangle>& triangles = result_.mesh.triangles;
    text_ += 'f';
    for (std::size_t k = 0; k < 3; ++k) {
      text_ += ' ';
      append_number(text_, triangles[face][k] + 1);
      const Index texture = look_.texture.empty() ? kNone : look_.texture.front().at(triangles, face, k);
      if (texture != kNone || normals_) text_ += '/';
      if (texture != kNone) append_number(text_, texture + 1);
      if (!normals_) continue;
      text_ += '/';
      append_number(text_, normals_->triangles[face][k] + 1);
    }
    text_ += '\n';
  }

  const LabelledMesh& result_;
  const Appearance& look_;
  std::string text_;
  std::optional<SplitMesh> normals_;
};

}  // namespace

Likeness looks_like_obj(const Sample& sample) {
  constexpr std::array<std::string_view, 13> kKeywords{"v", "vt", "vn", "vp", "f",      "o",     "g",
                                                       "s", "l",  "p",  "mg", "mtllib", "usemtl"};
  return std::find(kKeywords.begin(), kKeywords.end(), sample.word) == kKeywords.end() ? Likeness::kUnlike
                                                                                       : Likeness::kText;
}

MeshContent read_obj(std::string_view bytes, const DecodeLimits& limits) { return ObjReader(bytes, limits).read(); }

std::string write_obj(const LabelledMesh& result, const nlohmann::ordered_json& /*extras*/, const MeshStyle& style) {
  std::string text = ObjWriter(result).write();
  for (std::size_t edge = 0; edge < result.edges.size() && style.ridge_lines; ++edge) {
    if (!is_ridge(result.labels[edge])) continue;
    text += fmt::format("l {} {}\n", result.edges[edge].v0 + 1, result.edges[edge].v1 + 1);
  }
  return text;
}

}  // namespace crease
