#include "core/io/stl_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/text.h"

namespace crease {
namespace {

constexpr std::array<std::string_view, 9> kKeywords{"facet",    "vertex", "endloop", "endfacet", "outer",
                                                    "endsolid", "solid",  "normal",  "loop"};

/// In any case, but nearly always in lower case.
bool is(std::string_view word, std::string_view keyword) {
  return word == keyword || (word.size() == keyword.size() && equals_ignoring_case(word, keyword));
}

bool is_keyword(std::string_view word) {
  return std::ranges::any_of(kKeywords, [&](std::string_view keyword) { return is(word, keyword); });
}

/// Whether a word begins a comment, in the ways of other languages: STL has none.
bool begins_comment(std::string_view word) {
  return word.starts_with('#') || word.starts_with(';') || word.starts_with("//") || word.starts_with("/*");
}

/// Whether the rest of the line has three numbers in a row.
bool has_three_numbers(TextCursor line) {
  for (int numbers = 0; !line.at_line_end();) {
    numbers = std::isnan(number_of(line.word())) ? 0 : numbers + 1;
    if (numbers == 3) return true;
  }
  return false;
}

}  // namespace

bool is_stl_text(std::string_view text) {
  for (TextCursor cursor(text, {}); cursor.skip_to_word(); cursor.skip_line()) {
    const std::string_view word = cursor.word();
    if (is(word, "solid") || is(word, "facet")) return true;
  }
  return false;
}

bool StlText::next(StlFacet& facet) {
  if (!next_facet_start()) return false;
  expect("normal");
  facet.normal.clear();
  while (facet.normal.size() < 3 && !cursor_.at_line_end()) facet.normal.push_back(cursor_.word());
  if (next_keyword({"outer"}, true) != 0) cursor_.fail_expected("'outer'");
  expect("loop");
  facet.corners.clear();
  for (;;) {
    const std::size_t keyword = next_keyword({"vertex", "endloop"}, true);
    if (keyword == 1) break;
    if (keyword == 2) cursor_.fail_expected("'vertex' or 'endloop'");
    read_corner(facet.corners.emplace_back());
  }
  facet.line = cursor_.line();
  if (next_keyword({"endfacet"}, true) != 0) cursor_.fail_expected("'endfacet'");
  ++facets_;
  return true;
}

/// Moves behind the next "facet", through the ends and starts of solids.
bool StlText::next_facet_start() {
  for (;;) {
    switch (next_keyword({"facet", "endsolid", "solid", "end"}, false)) {
      case 0:
        return true;
      case 1:
      case 3:
        is_in_solid_ = false;
        break;
      case 2:
        is_in_solid_ = true;
        ++solids_;
        break;
      default:
        if (is_in_solid_ && facets_ == 0) cursor_.fail_expected("'facet' or 'endsolid'");
        return false;
    }
    skip_name();
  }
}

void StlText::read_corner(StlFacet::Corner& corner) {
  corner.line = cursor_.line();
  constexpr std::array<std::string_view, 3> kNames{"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k) {
    cursor_.at_line_end();
    const std::size_t start = cursor_.offset();
    corner.position[Eigen::Index(k)] = cursor_.number(kNames[k]);
    corner.words[k] = text_.substr(start, cursor_.offset() - start);
  }
  if (!corner.position.allFinite()) {
    cursor_.fail(code::kMeshNotFinite, "a vertex has a coordinate that is not a finite number");
  }
}

/// Reads the next keyword and returns its place in `wanted`, or their number at the end of the file.
std::size_t StlText::next_keyword(std::initializer_list<std::string_view> wanted, bool in_facet) {
  for (;;) {
    if (!cursor_.skip_to_word()) return wanted.size();
    const std::string_view word = cursor_.word();
    const bool begins_line = cursor_.line() != keyword_line_;
    keyword_line_ = cursor_.line();
    const auto* const found = std::ranges::find_if(wanted, [&](std::string_view keyword) { return is(word, keyword); });
    if (found != wanted.end()) return static_cast<std::size_t>(found - wanted.begin());
    skip_text(word, *wanted.begin(), in_facet || !begins_line);
  }
}

void StlText::expect(std::string_view keyword) {
  if (!cursor_.skip_to_word()) cursor_.fail_expected(fmt::format("'{}'", keyword));
  const std::string_view found = cursor_.word();
  if (is(found, keyword)) return;
  cursor_.fail(code::kMeshSyntax, fmt::format("expected '{}', found '{}'", keyword, printable(found)));
}

/// Skips the name of a solid, which ends with its line or before a facet.
void StlText::skip_name() {
  while (!cursor_.at_line_end()) {
    const TextCursor start = cursor_;
    if (!is(cursor_.word(), "facet")) continue;
    TextCursor ahead = cursor_;
    if (!is(ahead.word(), "normal")) continue;
    cursor_ = start;
    return;
  }
  cursor_.skip_line();
}

void StlText::skip_text(std::string_view word, std::string_view wanted, bool is_among_facets) {
  TextCursor text = cursor_;
  text.return_into(word, 0);
  if (is_keyword(word) || (is_among_facets && !begins_comment(word) && has_three_numbers(text))) {
    cursor_.fail(code::kMeshSyntax, fmt::format("expected '{}', found '{}'", wanted, printable(word)));
  }
  if (skipped_lines_++ == 0) first_skipped_ = fmt::format("{}: '{}'", text.place(), printable(text.rest_of_line()));
  cursor_.skip_line();
}

}  // namespace crease
