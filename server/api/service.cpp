#include "server/api/service.h"

#include "proto/parameter_table.h"
#include "server/api/openapi.h"

namespace creased {
namespace code = crease::code;
namespace {

using crease::Error;

void answer_json(Call& call, const nlohmann::ordered_json& answer, const std::string& type = kJson) {
  call.response.set_content(answer.dump(2) + "\n", type);
}

void get_parameters(Services& services, Call& call) {
  answer_json(call, crease::parameters_schema(services.parameters), "application/schema+json");
}

void get_health(Services&, Call& call) { answer_json(call, {{"status", "ok"}, {"version", CREASE_VERSION}}); }

void get_readiness(Services& services, Call& call) {
  if (services.shutting_down) throw Error(code::kShuttingDown, "the server is going down");
  const std::string reason = services.not_ready ? services.not_ready() : services.store.not_ready_reason();
  if (!reason.empty()) throw Error(code::kStoreUnavailable, reason);
  answer_json(call, {{"status", "ready"}});
}

void get_metrics(Services& services, Call& call) {
  const std::string text = services.metrics.text({.queued = services.store.queued(),
                                                  .longest_wait = services.store.longest_wait(),
                                                  .streams = services.streams.count(),
                                                  .connections = services.connections()});
  call.response.set_content(text, "text/plain; version=0.0.4; charset=utf-8");
}

void get_openapi(Services& services, Call& call) {
  const std::string type = "application/vnd.oai.openapi+json;version=3.1";
  static const nlohmann::ordered_json document = openapi_document(services.parameters);
  static const std::string text = document.dump(2) + "\n";
  if (call.exchange.base.empty()) return call.response.set_content(text, type);
  auto below = document;
  below["servers"][0]["url"] = call.exchange.base;
  answer_json(call, below, type);
}

}  // namespace

std::vector<Route> service_routes() {
  return {
      {"GET",
       "/v1/parameters",
       "get_parameters",
       "List the parameters as JSON Schema, with unit, range, default and meaning",
       {},
       {{200, "JSON Schema.", {"application/schema+json"}, ""}},
       {},
       get_parameters},
      {"GET",
       "/healthz",
       "get_health",
       "Check that the process is alive",
       {},
       {{200, "The process is alive.", {kJson}, ""}},
       {},
       get_health,
       Access::kProbe},
      {"GET",
       "/readyz",
       "get_readiness",
       "Check that the service accepts jobs",
       {},
       {{200, "The service accepts jobs.", {kJson}, ""}},
       {code::kShuttingDown, code::kStoreUnavailable},
       get_readiness,
       Access::kProbe},
      {"GET",
       "/metrics",
       "get_metrics",
       "Metrics in the Prometheus text format",
       {},
       {{200, "The metrics.", {"text/plain"}, ""}},
       {code::kForbidden},
       get_metrics,
       Access::kMetrics},
      {"GET",
       "/openapi.json",
       "get_openapi",
       "This OpenAPI document",
       {},
       {{200, "The OpenAPI 3.1 document.", {"application/vnd.oai.openapi+json"}, ""}},
       {},
       get_openapi,
       Access::kOpen},
  };
}

}  // namespace creased
