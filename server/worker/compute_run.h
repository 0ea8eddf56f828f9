#pragma once

#include "core/io/decode.h"
#include "crease/v1/compute.pb.h"

namespace creased {

/// The descriptors of a confined process; −1 for a file that the task does not have.
struct TaskFiles {
  int channel = -1, upload = -1, weights = -1, checkpoint = -1, output = -1, original = -1;
  crease::DecodeLimits limits;
};

/// The error of a write that failed with this errno.
crease::Error write_failure(int number);

/// Runs a job inside the confined process, from its upload to the files of its result. Reads orders between sweeps and
/// sends events over the channel.
/// \throw crease::Error when the upload is refused or a file cannot be written
void run(const crease::v1::RunTask& task, const TaskFiles& files);

}  // namespace creased
