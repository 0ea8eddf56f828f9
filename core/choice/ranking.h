#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include "core/choice/families.h"
#include "core/choice/report.h"

namespace crease {

// Settings by their expected errors, which are logarithms, one per setting.

/// Those for another surface than the one that is named get infinite errors.
void restrict_to_surface(const std::optional<std::string_view>& surface, std::span<const Setting> settings,
                         std::span<double> errors);

/// The setting with the smallest error.
std::size_t best_of(std::span<const double> errors);

/// Reports the best setting, how much worse the others are expected to be, and the margin. Weights are reported in
/// units of 1 / `unit`.
void report_ranking(std::span<const Setting> settings, std::span<const double> errors, double unit,
                    ChoiceReport& report);

}  // namespace crease
