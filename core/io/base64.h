#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace crease {

/// The bytes that base64 text (RFC 4648 §4, with or without padding) stands for; empty when it is not base64.
std::optional<std::string> decode_base64(std::string_view text);

}  // namespace crease
