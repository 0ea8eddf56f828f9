#pragma once

#include <cstdint>
#include <string>

#include "core/error.h"
#include "core/io/byte_cursor.h"
#include "core/io/ply_header.h"
#include "core/io/text_cursor.h"

namespace crease {

/// A text body. An element begins on a new line and may go on over several.
class PlyAsciiBody {
 public:
  explicit PlyAsciiBody(TextCursor cursor) : cursor_(cursor) {}

  void begin_element() {
    if (!cursor_.skip_to_word()) cursor_.fail_expected("an element");
  }
  void end_element() {
    if (!cursor_.at_line_end())
      cursor_.fail(code::kMeshSyntax, "the line has more values than the header has properties");
    cursor_.skip_line();
  }
  double number(PlyType /*type*/) { return cursor_.number_on_any_line("a number"); }
  std::int64_t integer(PlyType /*type*/) { return cursor_.integer_on_any_line("a vertex index"); }
  std::size_t length(PlyType /*type*/) { return cursor_.count_on_any_line("a list's length"); }
  void skip(PlyType /*type*/, std::size_t count) {
    for (; count != 0; --count) {
      if (cursor_.word().empty() && (!cursor_.skip_to_word() || cursor_.word().empty())) {
        cursor_.fail_expected("a value");
      }
    }
  }
  void require(PlyType /*type*/, std::size_t /*count*/) {}
  std::string place() const { return cursor_.place(); }
  std::size_t rest() const { return cursor_.rest() + 1; }         // the last line may lack its line end
  static std::size_t least_bytes(PlyType /*type*/) { return 2; }  // a digit and a blank
  bool has_trailing() { return cursor_.skip_to_word(); }

 protected:
  TextCursor cursor_;
};

/// A binary body with values of the types in the header.
class PlyBinaryBody {
 public:
  PlyBinaryBody(std::string_view bytes, std::size_t offset, bool big_endian) : cursor_(bytes, offset, big_endian) {}

  void begin_element() { start_ = cursor_.offset(); }
  void end_element() {}
  double number(PlyType type) {
    const char* at = cursor_.take(size_of(type));
    const bool big = cursor_.big_endian();
    switch (type) {
      case PlyType::kInt8:
        return load<std::int8_t>(at, big);
      case PlyType::kUint8:
        return load<std::uint8_t>(at, big);
      case PlyType::kInt16:
        return load<std::int16_t>(at, big);
      case PlyType::kUint16:
        return load<std::uint16_t>(at, big);
      case PlyType::kInt32:
        return load<std::int32_t>(at, big);
      case PlyType::kUint32:
        return load<std::uint32_t>(at, big);
      case PlyType::kFloat32:
        return static_cast<double>(load<float>(at, big));
      case PlyType::kFloat64:
        break;
    }
    return load<double>(at, big);
  }
  /// The type must be an integer type; a double holds its values exactly.
  std::int64_t integer(PlyType type) { return static_cast<std::int64_t>(number(type)); }
  std::size_t length(PlyType type) {
    const std::int64_t value = integer(type);
    if (value < 0) throw Error(code::kMeshSyntax, fmt::format("a list has the length {}", value), place());
    return static_cast<std::size_t>(value);
  }
  void skip(PlyType type, std::size_t count) { cursor_.take(count * size_of(type)); }
  void require(PlyType type, std::size_t count) const { ByteCursor(cursor_).take(count * size_of(type)); }
  std::string place() const { return fmt::format("byte {}", start_); }
  std::size_t rest() const { return cursor_.rest(); }
  static std::size_t least_bytes(PlyType type) { return size_of(type); }
  bool has_trailing() {
    start_ = cursor_.offset();
    return cursor_.rest() != 0;
  }

 protected:
  ByteCursor cursor_;

 private:
  std::size_t start_ = 0;  ///< of the current element
};

/// Whether the property names the corners of a face or strip.
inline bool is_corner_list(const PlyProperty& property) {
  return property.count_type.has_value() && (property.name == "vertex_indices" || property.name == "vertex_index");
}

}  // namespace crease
