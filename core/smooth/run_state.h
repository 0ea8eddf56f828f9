#pragma once

#include <vector>

#include "core/base/state_archive.h"
#include "core/choice/report.h"
#include "core/solve/run.h"

namespace crease {

// What checkpoints of the automatic setting have of records and reports.

/// Of the vertex stage and of the choice. \throw CheckpointError for more records than any run has
void exchange(StateArchive& archive, std::vector<SweepRecord>& records);

/// \throw CheckpointError for a direction that there is not, or more candidates than any choice has
void exchange(StateArchive& archive, ChoiceReport& report);

}  // namespace crease
