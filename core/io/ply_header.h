#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/io/text_cursor.h"

namespace crease {

enum class PlyType : std::uint8_t { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

std::size_t size_of(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat32;   ///< of the value, or of a list's items
  std::optional<PlyType> count_type;  ///< of a list's length; a whole-number type
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::string place;  ///< of its line in the header
  std::vector<PlyProperty> properties;
};

enum class PlyEncoding : std::uint8_t { kAscii, kLittleEndian, kBigEndian };

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;
  std::size_t binary_start = 0;  ///< offset of the body of a binary file
};

/// Reads the header and leaves the cursor at the first line after it. Counts are as the header promises them,
/// unchecked. \throw Error mesh_syntax, mesh_truncated, mesh_unsupported, mesh_too_large
PlyHeader read_ply_header(std::string_view bytes, TextCursor& cursor);

}  // namespace crease
