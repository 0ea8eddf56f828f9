#pragma once

#include "server/http/call.h"

namespace creased {

/// POST /v1/jobs. Receives, inspects, submits, and waits for the end of the job when Prefer says so.
void submit_job(Services& services, Call& call);

}  // namespace creased
