#include "core/choice/ranking.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace crease {

void restrict_to_surface(const std::optional<std::string_view>& surface, std::span<const Setting> settings,
                         std::span<double> errors) {
  if (!surface) return;
  for (std::size_t i = 0; i < settings.size(); ++i) {
    if (settings[i].family.name != *surface) errors[i] = std::numeric_limits<double>::infinity();
  }
}

std::size_t best_of(std::span<const double> errors) {
  return static_cast<std::size_t>(std::ranges::min_element(errors) - errors.begin());
}

void report_ranking(std::span<const Setting> settings, std::span<const double> errors, double unit,
                    ChoiceReport& report) {
  const std::size_t chosen = best_of(errors);
  report.family = settings[chosen].family.name;
  report.weight = settings[chosen].weight * unit;
  double other = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < settings.size(); ++i) {
    if (!std::isfinite(errors[i])) continue;
    const double ratio = std::exp(errors[i] - errors[chosen]);
    report.candidates.push_back({std::string(settings[i].family.name), settings[i].weight * unit, ratio});
    if (settings[i].family.name != report.family) other = std::min(other, ratio);
  }
  std::ranges::stable_sort(report.candidates, {}, &CandidateReport::expected_error);
  report.margin = std::isfinite(other) ? other - 1 : 0;
}

}  // namespace crease
