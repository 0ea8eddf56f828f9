#pragma once

#include "server/api/call.h"

namespace creased {

void list_jobs(Services& services, Call& call);
void get_job(Services& services, Call& call);
void cancel_job(Services& services, Call& call);
void delete_job(Services& services, Call& call);

}  // namespace creased
