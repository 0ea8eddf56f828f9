#pragma once

#include <string>

#include "core/base/state_archive.h"
#include "core/choice/report.h"
#include "core/solve/run.h"

namespace crease {

// What checkpoints of the automatic setting have of records and reports.

/// A record of the vertex stage or of the choice.
void exchange(StateArchive& archive, SweepRecord& record);

/// \throw CheckpointError for more records than any run has
void exchange(StateArchive& archive, std::vector<SweepRecord>& records);

void exchange(StateArchive& archive, ChoiceReport& report);

}  // namespace crease
