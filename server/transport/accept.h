#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace creased {

/// Index of the type in `offered`, best first, that an Accept header [RFC 9110 §12.5.1] prefers. An empty header
/// accepts everything; nullopt means that it accepts none of them.
std::optional<std::size_t> negotiate(std::string_view accept, std::span<const std::string_view> offered);

}  // namespace creased
