#pragma once

#include <string>
#include <vector>

#include "core/io/format.h"

namespace crease {

/// Those of `attributes` that a mesh loses when it is written in `format`.
std::vector<std::string> dropped_in(const Format& format, const std::vector<std::string>& attributes);

/// "ply does not keep: groups, materials"; empty if it keeps all.
std::string dropped_text(const Format& format, const std::vector<std::string>& attributes);

/// The text of the warning attributes_dropped about all formats.
std::string describe_dropped(const std::vector<std::string>& attributes);

}  // namespace crease
