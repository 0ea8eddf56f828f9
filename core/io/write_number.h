#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <string>

#include "core/mesh/mesh.h"

namespace crease {

/// Appends an integer in decimal, or the shortest decimal number that reads back to the same double.
template <typename Number>
void append_number(std::string& text, Number value) {
  std::array<char, 32> digits;
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  text.append(digits.data(), end);
}

/// Appends a number with up to six significant digits.
inline void append_rounded(std::string& text, double value) {
  std::array<char, 32> digits;
  const auto [end, error] =
      std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::general, 6);
  text.append(digits.data(), end);
}

/// Appends the bytes of a number, the least significant first.
template <typename Bytes, typename Number>
void append_little_endian(Bytes& bytes, Number value) {
  auto raw = std::bit_cast<std::array<char, sizeof(Number)>>(value);
  if constexpr (std::endian::native == std::endian::big) std::reverse(raw.begin(), raw.end());
  bytes.insert(bytes.end(), raw.begin(), raw.end());
}

/// Converts a position to single precision. \throw Error mesh_unsupported that names the vertex if it does not fit
std::array<float, 3> to_single(const Vec3& position, std::size_t vertex);

}  // namespace crease
