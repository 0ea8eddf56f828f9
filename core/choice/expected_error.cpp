#include "core/choice/expected_error.h"

#include <algorithm>

#include "core/choice/expected_error_table.h"

namespace crease {

const ErrorModel kFittedModel = kErrorModel;

std::array<double, kSettings.size()> expected_log_errors(const Features& features, const ErrorModel& model) {
  constexpr double kFarthest = ErrorModel::kFarthest;
  Features standardised{};
  for (std::size_t k = 0; k < kFeatures; ++k) {
    standardised[k] = std::clamp((features[k] - model.means[k]) / model.deviations[k], -kFarthest, kFarthest);
  }
  std::array<double, kSettings.size()> errors = model.constants;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    for (std::size_t k = 0; k < kFeatures; ++k) errors[i] += model.weights[i][k] * standardised[k];
  }
  return errors;
}

}  // namespace crease
