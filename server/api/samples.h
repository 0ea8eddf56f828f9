#pragma once

#include "server/api/call.h"

namespace creased {

/// Answers with the sample mesh that the path names, as binary PLY. \throw crease::Error not_found
void get_sample(Call& call);

}  // namespace creased
