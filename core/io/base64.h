#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace crease {

/// Decodes base64 (RFC 4648 §4, with or without padding). Empty if the text is not base64.
std::optional<std::string> decode_base64(std::string_view text);

/// The bytes of a data URI (RFC 2397), in base64 or in percent encoding. Empty if it is none.
std::optional<std::string> decode_data_uri(std::string_view uri);

/// Encodes bytes as base64 with padding.
std::string encode_base64(std::string_view bytes);

}  // namespace crease
