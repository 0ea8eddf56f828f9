#pragma once

#include <string>
#include <vector>

#include "tests/quality/fit_scans.h"

namespace crease::quality {

/// Prints what the choice knows of training models with independent noise, and the errors of the setting that it
/// chooses with other weights, after the regressions; a pair per line.
void measure_weights(const Part& of);

/// Prints core/choice/weight_table.h, and what the choice of weights gains to stderr.
void write_weight_table(const std::vector<std::string>& files);

}  // namespace crease::quality
