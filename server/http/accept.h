#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace creased {

/// The media type of `offered` (best first) that an Accept header [RFC 9110 §12.5.1] likes most, by index; an empty
/// header likes all. Nullopt: none of them.
std::optional<std::size_t> negotiate(std::string_view accept, std::span<const std::string_view> offered);

}  // namespace creased
