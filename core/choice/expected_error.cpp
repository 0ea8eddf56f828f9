#include "core/choice/expected_error.h"

#include "core/choice/expected_error_table.h"

namespace crease {

const SettingModel kFittedModel{{kFeatureMeans, kFeatureDeviations, kMeanErrors, kLandmarks}};

}  // namespace crease
