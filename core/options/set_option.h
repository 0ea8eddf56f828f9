#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/options/options.h"

namespace crease {

using OptionValue = std::variant<bool, std::uint32_t, double, std::string>;

/// Sets the field that the API calls `name`; angles named `_deg` are converted to radians. An option that the method
/// does not have, and a 0 that means the method's own, leave it as it is.
/// \throw Error parameter_unknown, parameter_invalid
void set_option(SmoothOptions& options, std::string_view name, const OptionValue& value);

/// Every option of the method under its API name, in the units of the API.
std::vector<std::pair<std::string, OptionValue>> option_values(const SmoothOptions& options);

}  // namespace crease
