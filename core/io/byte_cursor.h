#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "core/error.h"

namespace crease {

/// Loads a number in the given byte order from `bytes`, which must be long enough.
template <typename Number>
Number load(const char* bytes, bool big_endian) {
  std::array<char, sizeof(Number)> raw{};
  std::memcpy(raw.data(), bytes, sizeof(Number));
  if (big_endian != (std::endian::native == std::endian::big)) std::reverse(raw.begin(), raw.end());
  return std::bit_cast<Number>(raw);
}

/// Reads untrusted binary data from front to back. Reading past the end throws Error mesh_truncated with the place
/// "byte N".
class ByteCursor {
 public:
  explicit ByteCursor(std::string_view bytes, std::size_t offset = 0, bool big_endian = false)
      : bytes_(bytes), offset_(offset), big_endian_(big_endian) {}

  std::size_t offset() const { return offset_; }
  std::size_t rest() const { return bytes_.size() - offset_; }
  bool big_endian() const { return big_endian_; }
  std::string place() const { return fmt::format("byte {}", offset_); }

  /// Returns the next `count` bytes and moves past them.
  const char* take(std::size_t count) {
    if (count > rest()) fail_short(count);
    const char* first = bytes_.data() + offset_;
    offset_ += count;
    return first;
  }

  template <typename Number>
  Number read() {
    return load<Number>(take(sizeof(Number)), big_endian_);
  }

 private:
  /// Apart, so that the compiler makes take() a part of its callers.
  [[noreturn, gnu::cold, gnu::noinline]] void fail_short(std::size_t count) const {
    throw Error(code::kMeshTruncated, fmt::format("{} bytes are needed, but only {} are left", count, rest()), place());
  }

  std::string_view bytes_;
  std::size_t offset_;
  bool big_endian_;
};

}  // namespace crease
