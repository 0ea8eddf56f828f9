#pragma once

#include <map>
#include <string>

#include "server/api/call.h"
#include "server/api/downloads.h"
#include "server/api/events.h"
#include "server/api/page.h"
#include "server/transport/guarded_server.h"

namespace creased {

/// The HTTP API, version 1. Passes each request to the handler of its route and turns each error into a problem
/// document.
class Api {
 public:
  explicit Api(const Services& services);

  GuardedServer::Hooks hooks();
  /// Makes `server` answer with this API. Call it once, before the server starts.
  void attach(GuardedServer& server);

 private:
  using ServerResult = httplib::Server::HandlerResponse;

  ServerResult before_routing(const httplib::Request& request, httplib::Response& response);
  static ServerResult refuse(const Exchange& exchange, httplib::Response& response);
  int before_body(const httplib::Request& request, httplib::Response& response);
  void refuse_early(const httplib::Request& request, const RouteMatch& match, httplib::Response& response) const;
  void dispatch(const httplib::Request& request, httplib::Response& response, const httplib::ContentReader* body);
  std::uint64_t begin(Exchange& exchange);
  /// Checks the caller's key, rates and origin.
  void admit(Exchange& exchange, const RouteMatch& match);
  void check_key(const Exchange& exchange, Access access) const;
  void count(Exchange& exchange, const RouteMatch& match);
  void complete(const Exchange& exchange, httplib::Response& response) const;
  void finished(const ExchangeSummary& exchange);

  void get_readiness(Call& call);
  void get_metrics(Call& call);

  Services services_;
  Downloads downloads_;
  EventStreams streams_;
  Page page_;
  std::map<std::string, Handler> handlers_;  // by operation id
  const GuardedServer* server_ = nullptr;
};

}  // namespace creased
