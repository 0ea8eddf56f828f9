#pragma once

#include "server/api/call.h"

namespace creased {

/// POST /v1/jobs: receives the upload, inspects it, submits the job, and waits for its end when Prefer asks for it.
void submit_job(Services& services, Call& call);

}  // namespace creased
