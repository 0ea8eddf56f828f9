#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>

#include "proto/parameter_table.h"
#include "server/access/gatekeeper.h"
#include "server/access/link_signer.h"
#include "server/api/job_watcher.h"
#include "server/api/metrics.h"
#include "server/api/routes.h"
#include "server/store/store.h"
#include "server/transport/cors.h"
#include "server/transport/guarded_server.h"
#include "server/transport/library.h"
#include "server/worker/inspector.h"

namespace creased {

/// What the handlers share.
struct Services {
  Store& store;
  Inspector& inspector;
  JobWatcher& watcher;
  Metrics& metrics;
  Gatekeeper& gate;
  const LinkSigner& links;
  const std::atomic<bool>& shutting_down;
  CorsPolicy cors;
  std::size_t max_streams = 0;
  crease::OperatorSettings parameters;
  /// Why the service is not ready, as it is known; null to ask the store.
  std::function<std::string()> not_ready = nullptr;
  std::filesystem::path page;  ///< folder of the web page; empty for none
};

/// One request, as a handler sees it.
struct Call {
  const httplib::Request& request;
  httplib::Response& response;
  Exchange& exchange;
  const Route& route;
  std::string id;                                ///< id of the job, or name of the file, from the path
  std::string format;                            ///< at the end of the path; empty for none
  const httplib::ContentReader* body = nullptr;  ///< null for methods that have no body

  const Caller& caller() const { return exchange.caller; }
  /// The owner whose jobs this call can see.
  std::string owner() const { return caller().owner(); }
  /// A field of the query. The format may be at the end of the path instead.
  std::string query(const std::string& name, const std::string& fallback = {}) const {
    if (name == "format" && !format.empty()) return format;
    return query_value(request.params, name, fallback);
  }
};

using Handler = std::function<void(Call&)>;

/// The caller's job that the path names. \throw crease::Error job_not_found
crease::v1::Job find_job(Store& store, const Call& call);

/// A job as the API shows it, with its links, which begin with `base`.
std::string job_json(const crease::v1::Job& job, const std::string& base);

}  // namespace creased
