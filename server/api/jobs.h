#pragma once

#include <string>
#include <vector>

#include "server/api/route.h"

namespace creased {

/// Lists, shows, cancels and deletes jobs.
std::vector<Route> job_routes();

/// The caller's job that the path names. \throw crease::Error job_not_found
crease::v1::Job find_job(Store& store, const Call& call);

/// A job as the API shows it, with its links, which begin with `base`.
std::string job_json(const crease::v1::Job& job, const std::string& base);

}  // namespace creased
