#pragma once

#include "core/io/decode.h"
#include "crease/v1/compute.pb.h"

namespace creased {

/// What a confined process has: descriptors, −1 where there is none.
struct TaskFiles {
  int channel = -1, upload = -1, weights = -1, checkpoint = -1;
  crease::DecodeLimits limits;
};

/// A job from its upload to the files of its result, inside the confined process. Follows orders between sweeps and
/// tells of events over the channel.
/// \throw crease::Error what the upload or the files are refused for
void run(const crease::v1::RunTask& task, const TaskFiles& files);

}  // namespace creased
