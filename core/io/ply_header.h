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
  PlyType type = PlyType::kFloat32;   ///< type of the value, or of the items of a list
  std::optional<PlyType> count_type;  ///< type of the length of a list; an integer type
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::string place;  ///< the line in the header
  std::vector<PlyProperty> properties;
};

enum class PlyEncoding : std::uint8_t { kAscii, kLittleEndian, kBigEndian };

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;
  std::size_t binary_start = 0;  ///< offset of the body, for binary files
};

/// Reads the header and leaves the cursor at the first line after it. The counts in the header are not checked yet.
/// \throw Error mesh_syntax, mesh_truncated, mesh_unsupported, mesh_too_large
PlyHeader read_ply_header(std::string_view bytes, TextCursor& cursor);

}  // namespace crease
