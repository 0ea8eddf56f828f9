#pragma once

#include <atomic>
#include <functional>
#include <limits>
#include <string>

#include "proto/parameter_table.h"
#include "server/access/gatekeeper.h"
#include "server/access/link_signer.h"
#include "server/api/job_watcher.h"
#include "server/api/metrics.h"
#include "server/api/open_streams.h"
#include "server/api/page_files.h"
#include "server/api/result_files.h"
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
  ResultFiles& results;
  JobWatcher& watcher;
  Metrics& metrics;
  Gatekeeper& gate;
  const LinkSigner& links;
  OpenStreams& streams;
  const PageFiles& page;
  const std::atomic<bool>& shutting_down;
  CorsPolicy cors;
  crease::OperatorSettings parameters;
  std::uint32_t threads = 0;  ///< of a job that asks for none; 0 for as many as the machine has processors
  std::uint64_t job_memory_bytes = std::numeric_limits<std::uint64_t>::max();  ///< that a job may need at most
  /// Why the service is not ready, as it is known; null to ask the store.
  std::function<std::string()> not_ready = nullptr;
  /// The number of open connections.
  std::function<std::size_t()> connections = nullptr;
};

/// One request, as a handler sees it.
struct Call {
  const httplib::Request& request;
  httplib::Response& response;
  Exchange& exchange;
  std::string id;                                ///< id of the job, or name of the file, from the path
  std::string format;                            ///< at the end of the path; empty for none
  const httplib::ContentReader* body = nullptr;  ///< null for methods that have no body

  const Caller& caller() const { return exchange.caller; }
  /// The owner whose jobs this call can see.
  std::string owner() const { return caller().owner(); }
  /// A field of the query, or `fallback` when it is missing. The format may be at the end of the path instead.
  std::string query(const std::string& name, const std::string& fallback = {}) const;
  double query_number(const std::string& name, double fallback) const;
  bool query_flag(const std::string& name) const { return query(name) == "true"; }
};

}  // namespace creased
