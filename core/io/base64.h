#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace crease {

/// Decodes base64 (RFC 4648 §4, with or without padding). Empty if the text is not base64.
std::optional<std::string> decode_base64(std::string_view text);

/// Encodes bytes as base64 with padding.
std::string encode_base64(std::string_view bytes);

}  // namespace crease
