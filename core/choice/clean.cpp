#include "core/choice/clean.h"

#include "core/choice/clean_table.h"

namespace crease {

bool is_clean(const Features& features) {
  constexpr double kSure = 0.55;
  return kFittedCleanModel.expected(features)[0] > kSure;
}

const CleanModel kFittedCleanModel{{kCleanFeatureMeans, kCleanFeatureDeviations, kCleanMeanErrors, kCleanLandmarks}};

}  // namespace crease
