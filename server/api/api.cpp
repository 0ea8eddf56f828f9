#include "server/api/api.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cmath>

#include "core/base/text.h"
#include "proto/error_table.h"
#include "server/api/links.h"
#include "server/api/problem.h"
#include "server/base/log.h"

namespace creased {
namespace code = crease::code;
namespace {

using crease::equals_ignoring_case;
using crease::Error;

constexpr std::uint64_t kSmallBody = 64 * 1024;  // for calls that need no body

std::string name_of(crease::ErrorCode code) { return std::string(crease::error_kind(code).name); }

}  // namespace

GuardedServer::Hooks Api::hooks() {
  return {[this](Exchange& exchange) { return begin(exchange); },
          [this](const Exchange& exchange, httplib::Response& response) { complete(exchange, response); },
          [this](const ExchangeSummary& exchange) { finished(exchange); }, refusal};
}

void Api::attach(GuardedServer& server) {
  services_.connections = [&server] { return server.connections(); };
  const auto without_body = [this](const httplib::Request& request, httplib::Response& response) {
    dispatch(request, response, nullptr);
  };
  const auto with_body = [this](const httplib::Request& request, httplib::Response& response,
                                const httplib::ContentReader& body) { dispatch(request, response, &body); };
  server.Get(".*", without_body);
  server.Post(".*", with_body);
  server.Delete(".*", with_body);
  server.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
    return before_routing(request, response);
  });
  server.set_expect_100_continue_handler(
      [this](const httplib::Request& request, httplib::Response& response) { return before_body(request, response); });
  server.set_exception_handler([](const httplib::Request& request, httplib::Response& response,
                                  const std::exception_ptr&) {
    answer_problem(response, Error(code::kInternal, "an unexpected error occurred"), exchange_of(request).request_id);
  });
  server.set_error_handler([](const httplib::Request& request, httplib::Response& response) {
    if (response.body.empty()) {
      answer_problem(response, Error(code::kRequestMalformed, "the request could not be parsed"),
                     exchange_of(request).request_id);
    }
  });
}

std::uint64_t Api::begin(Exchange& exchange) {
  const RequestHead& head = exchange.head;
  const RouteMatch match = match_route(head.method, exchange.path);
  if (match.route != nullptr) exchange.route = match.route->path;
  exchange.caller = services_.gate.identify(head.header("Authorization"));
  try {
    admit(exchange, match);
  } catch (const Error& error) {
    exchange.refusal = error;
  }
  const bool upload = match.route != nullptr && match.route->takes_parameters();
  return upload ? std::uint64_t{exchange.caller.limits.max_upload_mb} << 20U : kSmallBody;
}

void Api::admit(Exchange& exchange, const RouteMatch& match) {
  const Access access = match.route == nullptr ? Access::kKey : match.route->access;
  if (access == Access::kProbe || exchange.path.empty()) return;
  count(exchange, match);
  // Browsers send preflight requests without the key.
  if (exchange.head.method == "OPTIONS") return;
  if (is_linked(exchange, match.route)) {
    follow_link(services_.links, services_.gate, exchange);
  } else {
    check_key(exchange, access);
  }
  if (services_.cors.forbids(exchange.head)) {
    throw Error(code::kOriginNotAllowed,
                fmt::format("pages from {} may not change anything on this server", exchange.head.header("Origin")));
  }
}

void Api::check_key(const Exchange& exchange, Access access) const {
  if (!services_.gate.keyed() || access == Access::kOpen) return;
  if (access == Access::kMetrics && exchange.source.local) return;
  if (exchange.caller.key == nullptr) {
    const bool given = exchange.head.count("Authorization") > 0;
    throw Error(code::kUnauthorized, given ? "the key is not valid for this service"
                                           : "this call needs a key, sent as 'Authorization: Bearer KEY'");
  }
  if (access == Access::kMetrics && !exchange.caller.key->metrics) {
    throw Error(code::kForbidden, "this key may not read the metrics");
  }
}

void Api::count(Exchange& exchange, const RouteMatch& match) {
  auto wait = services_.gate.count_call(exchange.caller, exchange.source);
  std::string_view what = "calls";
  const bool allowed = !services_.gate.keyed() || exchange.caller.key != nullptr;
  if (wait.count() == 0 && allowed && match.route != nullptr && match.route->takes_parameters()) {
    wait = services_.gate.count_job(exchange.caller, exchange.source);
    what = "jobs";
  }
  if (wait.count() == 0) return;
  exchange.retry_after = wait;
  throw Error(code::kRateLimited,
              fmt::format("the rate limit for {} is reached; try again in {} s", what, wait.count()));
}

void Api::complete(const Exchange& exchange, httplib::Response& response) const {
  services_.cors.add_headers(exchange.head, response);
}

Api::ServerResult Api::before_routing(const httplib::Request& request, httplib::Response& response) {
  const RouteMatch match = match_route(request.method, request.path);
  Exchange& exchange = exchange_of(request);
  if (exchange.refusal) return refuse(exchange, response);
  if (exchange.path.empty()) {
    // Addresses in the page are relative to the slash.
    response.status = 308;
    response.set_header("Location", exchange.base + "/");
    return ServerResult::Handled;
  }
  if (request.method == "OPTIONS" && (request.path == "*" || !match.allowed.empty())) {
    response.status = 204;
    response.set_header("Allow", request.path == "*" ? "GET, HEAD, POST, DELETE, OPTIONS"
                                                     : fmt::format("{}", fmt::join(match.allowed, ", ")));
    return ServerResult::Handled;
  }
  guarded(exchange, response, [&] { refuse_early(request, match, response); });
  return response.status == -1 ? ServerResult::Unhandled : ServerResult::Handled;
}

Api::ServerResult Api::refuse(Exchange& exchange, httplib::Response& response) {
  if (exchange.retry_after.count() > 0) {
    response.set_header("Retry-After", std::to_string(exchange.retry_after.count()));
  }
  if (exchange.refusal->code() == code::kUnauthorized) {
    const bool given = exchange.head.count("Authorization") > 0;
    response.set_header("WWW-Authenticate",
                        given ? R"(Bearer realm="creased", error="invalid_token")" : R"(Bearer realm="creased")");
  }
  exchange.code = exchange.refusal->code();
  answer_problem(response, *exchange.refusal, exchange.request_id);
  return ServerResult::Handled;
}

int Api::before_body(const httplib::Request& request, httplib::Response& response) {
  return before_routing(request, response) == ServerResult::Handled ? response.status : 100;
}

void Api::refuse_early(const httplib::Request& request, const RouteMatch& match, httplib::Response& response) const {
  if (match.allowed.empty()) throw Error(code::kNotFound, "no resource at " + request.path);
  if (match.route == nullptr) {
    response.set_header("Allow", fmt::format("{}", fmt::join(match.allowed, ", ")));
    throw Error(code::kMethodNotAllowed,
                "this resource does not support " + request.method + "; the Allow header lists its methods");
  }
  const Exchange& exchange = exchange_of(request);
  const std::string_view encoding = exchange.head.header("Content-Encoding");
  if (!encoding.empty() && !equals_ignoring_case(encoding, "identity")) {
    throw Error(code::kContentEncodingUnsupported, "send the body uncompressed, without Content-Encoding");
  }
  if (exchange.stream.body_fault()) {
    throw Error(*exchange.stream.body_fault(), "the body is larger than this call accepts");
  }
  check_query(*match.route, request.params);
  if (!match.format.empty() && request.has_param("format")) {
    throw Error::parameter(code::kParameterInvalid, "format", request.get_param_value("format"),
                           "no such field where the path ends in the format");
  }
  if (match.route->takes_parameters() && services_.shutting_down) {
    throw Error(code::kShuttingDown, "the server is going down");
  }
}

void Api::dispatch(const httplib::Request& request, httplib::Response& response, const httplib::ContentReader* body) {
  RouteMatch match = match_route(request.method, request.path);
  Exchange& exchange = exchange_of(request);
  guarded(exchange, response, [&] {
    Call call{request, response, exchange, std::move(match.id), std::move(match.format), body};
    match.route->answer(services_, call);
  });
}

void Api::finished(const ExchangeSummary& exchange) {
  services_.metrics.count(exchange);
  constexpr int kRefused = 400;
  const std::string reason = exchange.code ? name_of(*exchange.code) : std::to_string(exchange.status);
  if (exchange.status >= kRefused && !refusals_.admit(reason)) return;
  nlohmann::ordered_json fields = {{"id", exchange.request_id},
                                   {"method", exchange.method},
                                   {"path", without_secrets(without_signature(exchange.target))},
                                   {"status", exchange.status},
                                   {"bytes", exchange.bytes_out},
                                   {"ms", std::round(exchange.seconds * 1e4) / 10},
                                   {"remote", exchange.remote}};
  if (!exchange.key.empty()) fields["key"] = exchange.key;
  if (exchange.code) fields["code"] = name_of(*exchange.code);
  log_event(spdlog::level::info, "request", fields);
}

void Api::log_refusals() {
  constexpr std::chrono::seconds kEvery{1};
  for (const auto& summary : refusals_.take_summaries(kEvery)) {
    log_event(spdlog::level::warn, "more requests were refused, not logged one by one",
              {{"code", summary.reason}, {"count", summary.count}, {"seconds", std::round(summary.seconds * 10) / 10}});
  }
}

/// Runs `work` and answers its errors with problem documents. Only the text of our own errors is shown to the client.
void Api::guarded(Exchange& exchange, httplib::Response& response, const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    exchange.code = error.code();
    const std::string name = name_of(error.code());
    if (crease::error_kind(error.code()).status >= 500 && refusals_.admit("detail of " + name)) {
      log_event(spdlog::level::warn, "request refused",
                {{"id", exchange.request_id}, {"code", name}, {"detail", error.detail()}});
    }
    answer_problem(response, error, exchange.request_id);
  } catch (const std::exception& error) {
    exchange.code = code::kInternal;
    log_event(spdlog::level::err, "request failed", {{"id", exchange.request_id}, {"what", error.what()}});
    answer_problem(response, Error(code::kInternal, "an unexpected error occurred; the server's log has the details"),
                   exchange.request_id);
  }
}

}  // namespace creased
