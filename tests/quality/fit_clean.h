#pragma once

#include <string>
#include <vector>

#include "tests/quality/fit_scans.h"

namespace crease::quality {

/// Prints features of training models without noise and with little of it, a mesh per line.
void measure_clean(const Part& of);

/// Prints core/choice/clean_table.h, and what is taken for clean to stderr.
void write_clean_table(const std::vector<std::string>& files);

}  // namespace crease::quality
