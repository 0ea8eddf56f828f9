#include "core/io/ply_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/base/text.h"
#include "core/error.h"

namespace crease {
namespace {

constexpr std::size_t kMostHeaderLines = 10'000;

struct TypeName {
  std::string_view name;
  PlyType type;
};

constexpr std::array<TypeName, 16> kTypeNames{{
    {"char", PlyType::kInt8},
    {"int8", PlyType::kInt8},
    {"uchar", PlyType::kUint8},
    {"uint8", PlyType::kUint8},
    {"short", PlyType::kInt16},
    {"int16", PlyType::kInt16},
    {"ushort", PlyType::kUint16},
    {"uint16", PlyType::kUint16},
    {"int", PlyType::kInt32},
    {"int32", PlyType::kInt32},
    {"uint", PlyType::kUint32},
    {"uint32", PlyType::kUint32},
    {"float", PlyType::kFloat32},
    {"float32", PlyType::kFloat32},
    {"double", PlyType::kFloat64},
    {"float64", PlyType::kFloat64},
}};

class HeaderReader {
 public:
  HeaderReader(std::string_view bytes, TextCursor& cursor) : bytes_(bytes), cursor_(cursor) {}

  PlyHeader read() {
    if (cursor_.word() != "ply") cursor_.fail(code::kMeshSyntax, "expected 'ply' in the first line");
    cursor_.skip_line();
    while (read_line()) cursor_.skip_line();
    if (!format_seen_) cursor_.fail(code::kMeshSyntax, "the header has no line 'format'");
    header_.binary_start = after_line_end();
    cursor_.skip_line();
    return std::move(header_);
  }

 private:
  bool read_line() {
    if (!cursor_.skip_to_word()) cursor_.fail_expected("'end_header'");
    if (cursor_.line() > kMostHeaderLines) {
      cursor_.fail(code::kMeshTooLarge, fmt::format("the header has more than {} lines", kMostHeaderLines));
    }
    const std::string_view keyword = cursor_.word();
    if (keyword == "end_header") return false;
    if (keyword == "format") {
      read_format();
    } else if (keyword == "element") {
      read_element();
    } else if (keyword == "property") {
      read_property();
    } else if (keyword != "comment" && keyword != "obj_info") {
      cursor_.fail(code::kMeshSyntax, "unknown keyword '" + printable(keyword) + "' in the header");
    }
    return true;
  }

  void read_format() {
    const std::string_view name = required_word("the format's name");
    if (name == "ascii") {
      header_.encoding = PlyEncoding::kAscii;
    } else if (name == "binary_little_endian") {
      header_.encoding = PlyEncoding::kLittleEndian;
    } else if (name == "binary_big_endian") {
      header_.encoding = PlyEncoding::kBigEndian;
    } else {
      cursor_.fail(code::kMeshSyntax, "unknown format '" + printable(name) + "'");
    }
    const std::string_view version = required_word("the format's version");
    if (version != "1.0")
      cursor_.fail(code::kMeshUnsupported, "PLY version " + printable(version) + " is not supported");
    format_seen_ = true;
  }

  void read_element() {
    PlyElement element;
    element.name = required_word("the element's name");
    element.count = cursor_.count("the number of elements");
    element.place = cursor_.place();
    const bool repeated = std::any_of(header_.elements.begin(), header_.elements.end(),
                                      [&](const PlyElement& other) { return other.name == element.name; });
    if (repeated) cursor_.fail(code::kMeshSyntax, "the header has two elements '" + printable(element.name) + "'");
    header_.elements.push_back(std::move(element));
  }

  void read_property() {
    if (header_.elements.empty()) cursor_.fail(code::kMeshSyntax, "a property comes before the first element");
    PlyProperty property;
    std::string_view type = required_word("the property's type");
    if (type == "list") {
      property.count_type = type_from_name(required_word("the type of the list's length"));
      if (*property.count_type == PlyType::kFloat32 || *property.count_type == PlyType::kFloat64) {
        cursor_.fail(code::kMeshSyntax, "the length of a list must have an integer type");
      }
      type = required_word("the type of the list's items");
    }
    property.type = type_from_name(type);
    property.name = required_word("the property's name");
    header_.elements.back().properties.push_back(std::move(property));
  }

  PlyType type_from_name(std::string_view name) const {
    for (const TypeName& row : kTypeNames) {
      if (row.name == name) return row.type;
    }
    cursor_.fail(code::kMeshSyntax, "unknown type '" + printable(name) + "'");
  }

  std::string_view required_word(std::string_view what) {
    const std::string_view word = cursor_.word();
    if (word.empty()) cursor_.fail_expected(what);
    return word;
  }

  /// Returns where the body starts. A lone CR ends the header only if it ended the first line too. Otherwise a CR LF is
  /// one line end.
  std::size_t after_line_end() {
    if (!cursor_.at_line_end()) cursor_.fail(code::kMeshSyntax, "expected a line end after 'end_header'");
    const std::size_t end = cursor_.offset();
    const std::string_view first = bytes_.substr(bytes_.find_first_of("\r\n"), 2);
    const bool lone_returns = first.front() == '\r' && first != "\r\n";
    const bool pair = bytes_.substr(end, 2) == "\r\n";
    return std::min(bytes_.size(), end + (pair && !lone_returns ? 2 : 1));
  }

  std::string_view bytes_;
  TextCursor& cursor_;
  PlyHeader header_;
  bool format_seen_ = false;
};

}  // namespace

std::size_t size_of(PlyType type) {
  switch (type) {
    case PlyType::kInt8:
    case PlyType::kUint8:
      return 1;
    case PlyType::kInt16:
    case PlyType::kUint16:
      return 2;
    case PlyType::kInt32:
    case PlyType::kUint32:
    case PlyType::kFloat32:
      return 4;
    case PlyType::kFloat64:
      break;
  }
  return 8;
}

PlyHeader read_ply_header(std::string_view bytes, TextCursor& cursor) { return HeaderReader(bytes, cursor).read(); }

}  // namespace crease
