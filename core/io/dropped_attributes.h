#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/io/format.h"

namespace crease {

/// The code of the warning about them.
inline constexpr std::string_view kAttributesDropped = "attributes_dropped";

/// Those of `attributes` that a mesh loses when it is written in `format`.
std::vector<std::string> dropped_in(const Format& format, const std::vector<std::string>& attributes);

/// "ply does not keep: groups, materials"; empty if it keeps all.
std::string dropped_text(const Format& format, const std::vector<std::string>& attributes);

/// The text of the warning about all formats.
std::string describe_dropped(const std::vector<std::string>& attributes);

}  // namespace crease
