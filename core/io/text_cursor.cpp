#include "core/io/text_cursor.h"

#include <fmt/format.h>

#include <limits>

#include "core/base/text.h"
#include "core/error.h"

namespace crease {
namespace {

/// Whether a number that a double cannot hold is too small, rather than too large.
bool underflows(std::string_view word) {
  if (word.find("e-") != std::string_view::npos || word.find("E-") != std::string_view::npos) return true;
  if (word.find_first_of("eE") != std::string_view::npos) return false;
  return word.substr(word.find_first_not_of("+-")).find_first_of("123456789") > word.find('.');
}

}  // namespace

double number_of(std::string_view word) {
  double value = 0;
  const char* end = word.data() + word.size();
  const auto [last, error] = std::from_chars(word.data(), end, value);
  return error == std::errc{} && last == end ? value : std::numeric_limits<double>::quiet_NaN();
}

void TextCursor::skip_line() {
  bool in_comment = false;
  while (pos_ != end_ && !is_newline(*pos_)) {
    in_comment = in_comment || *pos_ == style_.comment;
    if (*pos_ != '\\' || in_comment || !skip_continuation()) ++pos_;
  }
  if (pos_ == end_) return;
  pos_ += *pos_ == '\r' && pos_ + 1 != end_ && pos_[1] == '\n' ? 2 : 1;
  ++line_;
}

std::size_t TextCursor::count(std::string_view what) {
  std::uint64_t value = 0;
  if (parse(value)) return value;
  if (at_line_end()) fail_expected(what);
  const std::string_view found = word();
  if (found.find_first_not_of("0123456789") != std::string_view::npos) {
    fail(code::kMeshSyntax, fmt::format("expected {}, found '{}'", what, printable(found)));
  }
  fail(code::kMeshTooLarge, fmt::format("{} is {}, which exceeds every limit", what, printable(found)));
}

double TextCursor::odd_number(std::string_view what) {
  if (at_line_end()) fail_expected(what);
  const std::string_view found = word();
  const std::string_view digits = found.substr(found.starts_with('+') ? 1 : 0);
  double value = 0;
  const auto [last, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc::result_out_of_range || last != digits.data() + digits.size()) {
    fail(code::kMeshSyntax, fmt::format("expected {}, found '{}'", what, printable(found)));
  }
  return underflows(found) ? 0.0 : std::numeric_limits<double>::infinity();
}

std::int64_t TextCursor::odd_integer(std::string_view what) {
  if (at_line_end()) fail_expected(what);
  const std::string_view found = word();
  fail(code::kMeshSyntax, fmt::format("expected {}, found '{}'", what, printable(found)));
}

void TextCursor::fail(ErrorCode code, const std::string& detail) const { throw Error(code, detail, place()); }

void TextCursor::fail_expected(std::string_view what) const {
  if (at_end()) fail(code::kMeshTruncated, fmt::format("the file ends where {} is expected", what));
  fail(code::kMeshSyntax, fmt::format("the line ends where {} is expected", what));
}

}  // namespace crease
