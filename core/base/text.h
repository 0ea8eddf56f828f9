#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace crease {

/// The text without the blanks and tabs at its ends.
std::string_view trimmed(std::string_view text);

/// The text with its ASCII letters in lower case, whatever the locale.
std::string lower(std::string_view text);

/// Whether two texts are the same apart from the case of ASCII letters.
bool equals_ignoring_case(std::string_view a, std::string_view b);

/// Two lower-case hexadecimal digits for each byte.
std::string hex(std::span<const unsigned char> bytes);

/// The text with every byte that is not UTF-8 replaced by U+FFFD. Control characters stay.
std::string valid_utf8(std::string_view text);

/// The text cut to a length that fits a message, with everything but printable ASCII replaced by '?'.
std::string printable(std::string_view text);

}  // namespace crease
