#pragma once

#include "core/choice/error_model.h"
#include "core/choice/families.h"
#include "core/choice/features.h"

namespace crease {

/// Of the logarithms of the mean normal errors of kSettings over that of the best of them; more than kWorst counts as
/// kWorst.
struct SettingModel : ErrorModel<kFeatures, kSettings.size(), Kernel::kExponential> {
  static constexpr double kWorst = 0.8;
};
using SettingErrors = SettingModel::Errors;

/// The model that was fitted on the training pairs of tests/quality (tests/quality/fit_choice.cpp).
extern const SettingModel kFittedModel;

}  // namespace crease
