#pragma once

#include <string>
#include <vector>

#include "tests/quality/fit_scans.h"

namespace crease::quality {

/// Prints what tells the direction of the noise of training models with noise of all kinds, a mesh per line.
void measure_directions(const Part& of);

/// Prints core/choice/noise_direction_table.h, and how often it is right to stderr.
void write_direction_table(const std::vector<std::string>& files);

}  // namespace crease::quality
