#pragma once

#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>

#include "core/error_code.h"

namespace crease {

/// The word as a number; NaN if it is none.
double number_of(std::string_view word);

/// Reads untrusted text line by line and word by word. Lines end with LF, CR LF or CR and are counted from 1. Every
/// fault is an Error with the place "line N": mesh_truncated if the text ends too early, otherwise mesh_syntax.
class TextCursor {
 public:
  /// The syntax of a text apart from words and line ends.
  struct Style {
    char comment = '\n';     ///< starts a comment to the end of the line; '\n' for none
    bool backslash = false;  ///< a backslash at the end of a line joins it with the next
  };

  TextCursor(std::string_view text, Style style)
      : begin_(text.data()), pos_(begin_), end_(begin_ + text.size()), style_(style) {
    if (text.starts_with("\xef\xbb\xbf")) pos_ += 3;
  }

  std::size_t line() const { return line_; }
  std::size_t offset() const { return static_cast<std::size_t>(pos_ - begin_); }
  std::size_t rest() const { return static_cast<std::size_t>(end_ - pos_); }
  bool at_end() const { return pos_ == end_; }

  /// Skips blanks. Returns whether the rest of the line is empty or a comment.
  bool at_line_end() {
    skip_blanks();
    return pos_ == end_ || is_newline(*pos_) || *pos_ == style_.comment;
  }

  /// Moves to the start of the next line.
  void skip_line();

  /// Moves to the next word, across line ends and comments. Returns false if there is none.
  bool skip_to_word() {
    while (at_line_end()) {
      if (pos_ == end_) return false;
      skip_line();
    }
    return true;
  }

  /// Reads the next word of the line; empty at the end of the line.
  std::string_view word() {
    skip_blanks();
    const char* first = pos_;
    while (!ends_word(pos_)) ++pos_;
    return {first, static_cast<std::size_t>(pos_ - first)};
  }

  /// Reads the next word of the line as a number, which may be infinite or NaN. Errors name it by `what`.
  double number(std::string_view what) {
    double value = 0;
    return parse(value) ? value : odd_number(what);
  }

  /// Reads the next word of the line as an integer.
  std::int64_t integer(std::string_view what) {
    std::int64_t value = 0;
    return parse(value) ? value : odd_integer(what);
  }

  /// Reads the next word of the line as a count, 0 or more. \throw Error mesh_too_large beyond 64 bits
  std::size_t count(std::string_view what);

  /// The same, for values that may go on in the next line.
  double number_on_any_line(std::string_view what) {
    double value = 0;
    if (parse(value)) return value;
    if (at_line_end()) skip_to_word();
    return number(what);
  }
  std::int64_t integer_on_any_line(std::string_view what) {
    std::int64_t value = 0;
    if (parse(value)) return value;
    if (at_line_end()) skip_to_word();
    return integer(what);
  }
  std::size_t count_on_any_line(std::string_view what) {
    if (at_line_end()) skip_to_word();
    return count(what);
  }

  /// Moves back to `count` characters after `word`, which was read last on this line.
  void return_into(std::string_view word, std::size_t count) { pos_ = word.data() + count; }

  /// Reads an integer right here, whatever follows it. Returns false if there is none.
  bool leading_integer(std::int64_t& value) {
    const auto [last, error] = std::from_chars(pos_, end_, value);
    if (error != std::errc{}) return false;
    pos_ = last;
    return true;
  }

  /// Skips the character if it is right here.
  bool skip(char character) {
    if (pos_ == end_ || *pos_ != character) return false;
    ++pos_;
    return true;
  }

  /// Reads the rest of the line without the blanks around it and without a comment.
  std::string_view rest_of_line() {
    skip_blanks();
    const char* first = pos_;
    const char* last = pos_;
    for (; pos_ != end_ && !is_newline(*pos_) && *pos_ != style_.comment; ++pos_) {
      if (!is_blank(*pos_)) last = pos_ + 1;
    }
    return {first, static_cast<std::size_t>(last - first)};
  }

  /// Skips the rest of the word. Stops and returns false at the first character that is not `allowed`.
  template <typename Allowed>
  bool skip_word_of(Allowed&& allowed) {
    for (; !ends_word(pos_); ++pos_) {
      if (!allowed(*pos_)) return false;
    }
    return true;
  }

  std::string place() const { return "line " + std::to_string(line_); }
  [[noreturn]] void fail(ErrorCode code, const std::string& detail) const;
  /// Reports that `what` is missing: mesh_truncated at the end of the text, otherwise mesh_syntax.
  [[noreturn]] void fail_expected(std::string_view what) const;

 private:
  static bool is_newline(char c) { return c == '\n' || c == '\r'; }
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

  bool ends_word(const char* at) const {
    if (at == end_) return true;
    if (*at > ' ' && *at != style_.comment && *at != '\\') return false;  // nearly always, so it comes first
    return is_blank(*at) || is_newline(*at) || *at == style_.comment || (*at == '\\' && continuation_length(at) != 0);
  }

  std::size_t continuation_length(const char* at) const {
    if (!style_.backslash || at + 1 == end_ || !is_newline(at[1])) return 0;
    return at[1] == '\r' && at + 2 != end_ && at[2] == '\n' ? 3 : 2;
  }

  bool skip_continuation() {
    const std::size_t length = continuation_length(pos_);
    if (length == 0) return false;
    pos_ += length;
    ++line_;
    return true;
  }

  void skip_blanks() {
    while (pos_ != end_) {
      if (is_blank(*pos_)) {
        ++pos_;
      } else if (*pos_ != '\\' || !skip_continuation()) {
        return;
      }
    }
  }

  template <typename Number>
  bool parse(Number& value) {
    skip_blanks();
    const char* first = pos_;
    if (end_ - first > 1 && first[0] == '+' && first[1] != '-') ++first;
    const auto [last, error] = std::from_chars(first, end_, value);
    if (error != std::errc{} || !ends_word(last)) return false;
    pos_ = last;
    return true;
  }

  double odd_number(std::string_view what);
  [[noreturn]] std::int64_t odd_integer(std::string_view what);

  const char* begin_;
  const char* pos_;
  const char* end_;
  Style style_;
  std::size_t line_ = 1;
};

}  // namespace crease
