#pragma once

#include <utility>

#include "server/api/call.h"
#include "server/api/refusal_log.h"
#include "server/api/routes.h"
#include "server/transport/guarded_server.h"

namespace creased {

/// The HTTP API, version 1. Passes each request to the handler of its route and turns each error into a problem
/// document.
class Api {
 public:
  explicit Api(Services services) : services_(std::move(services)) {}

  GuardedServer::Hooks hooks();
  /// Makes `server` answer with this API. Call it once, before the server starts.
  void attach(GuardedServer& server);

  /// Logs how many refusals were not logged one by one. Call it about once a second.
  void log_refusals();

 private:
  using ServerResult = httplib::Server::HandlerResponse;

  ServerResult before_routing(const httplib::Request& request, httplib::Response& response);
  static ServerResult refuse(Exchange& exchange, httplib::Response& response);
  int before_body(const httplib::Request& request, httplib::Response& response);
  void refuse_early(const httplib::Request& request, const RouteMatch& match, httplib::Response& response) const;
  void dispatch(const httplib::Request& request, httplib::Response& response, const httplib::ContentReader* body);
  std::uint64_t begin(Exchange& exchange);
  /// Checks the caller's key, rates and origin.
  void admit(Exchange& exchange, const RouteMatch& match);
  void check_key(const Exchange& exchange, Access access) const;
  void count(Exchange& exchange, const RouteMatch& match);
  void complete(const Exchange& exchange, httplib::Response& response) const;
  void guarded(Exchange& exchange, httplib::Response& response, const std::function<void()>& work);
  void finished(const ExchangeSummary& exchange);

  Services services_;
  RefusalLog refusals_;
};

}  // namespace creased
