#include "server/api/links.h"

#include <algorithm>
#include <chrono>

#include "server/api/jobs.h"
#include "server/api/results.h"
#include "server/api/routes.h"
#include "server/store/job_facts.h"

namespace creased {
namespace code = crease::code;
namespace {

using crease::Error;

constexpr double kDaySeconds = 86'400;
// Fields of the query that say what the link is, not what it reads.
const std::vector<std::string> kOfLink = {"result", "format", "expires_in"};

/// Answers with the signed address of one part of a job.
void create_link(Services& services, Call& call) {
  if (call.exchange.head.has_body()) {
    throw Error(code::kRequestMalformed, "this call takes its fields in the query, and no body");
  }
  const Route& route = route_of(std::ranges::find(link_targets(), call.query("result"), &LinkTarget::name)->operation);
  find_job(services.store, call);
  httplib::Params query = call.request.params;
  for (const auto& name : kOfLink) query.erase(name);
  const std::string format = call.query("format");
  httplib::Params fields = query;
  if (!format.empty()) fields.emplace("format", format);
  check_query(route, fields);

  const auto seconds = static_cast<std::int64_t>(call.query_number("expires_in", kDaySeconds));
  const std::int64_t expires = now_ms() / 1000 + seconds;
  query.emplace(LinkSigner::kExpires, std::to_string(expires));
  if (!call.owner().empty()) query.emplace(LinkSigner::kKey, call.owner());
  std::string path = route.path;
  path.replace(path.find("{id}"), 4, call.id);
  if (!format.empty()) path += "." + format;
  query.emplace(LinkSigner::kSignature, services.links.signature(path, query));
  const nlohmann::ordered_json answer = {{"url", httplib::append_query_params(call.exchange.base + path, query)},
                                         {"expires_at", timestamp(expires * 1000)}};
  call.response.status = 201;
  call.response.set_content(answer.dump(2) + "\n", "application/json");
}

/// Adds the fields that reading a part of a result may have, whichever part has them.
void add_fields_of_results(std::vector<QueryField>& fields) {
  for (const Route& route : result_routes()) {
    for (const QueryField& field : route.query) {
      const auto known = std::ranges::find(fields, field.name, &QueryField::name);
      if (known == fields.end()) {
        fields.push_back(field);
        fields.back().meaning = "As for what the link reads.";
        continue;
      }
      for (const std::string& value : field.values) {
        if (std::ranges::find(known->values, value) == known->values.end()) known->values.push_back(value);
      }
    }
  }
}

}  // namespace

std::vector<Route> link_routes() {
  std::vector<std::string> targets;
  for (const auto& target : link_targets()) targets.push_back(target.name);
  std::vector<QueryField> fields = {{.name = "result",
                                     .type = "string",
                                     .meaning = "What the link reads.",
                                     .values = std::move(targets),
                                     .required = true}};
  add_fields_of_results(fields);
  fields.push_back(
      {"expires_in", "integer", "Seconds until the link expires; a day by default.", {}, 1, 30.0 * 86'400});
  return {{"POST",
           "/v1/jobs/{id}/links",
           "create_link",
           "Make a link that reads one part of a job without a key, for some time",
           std::move(fields),
           {{201, "The link.", {kJson}, "Link"}},
           {code::kJobNotFound, code::kParameterInvalid, code::kParameterOutOfRange},
           create_link}};
}

const std::vector<LinkTarget>& link_targets() {
  static const std::vector<LinkTarget> targets = {{"job", "get_job"},       {"events", "watch_job"},
                                                  {"mesh", "get_mesh"},     {"labels", "get_labels"},
                                                  {"ridges", "get_ridges"}, {"report", "get_report"}};
  return targets;
}

bool Route::can_be_linked() const {
  return std::ranges::find(link_targets(), operation, &LinkTarget::operation) != link_targets().end();
}

void add_link_fields(Route& route) {
  const auto field = [&](std::string_view name, const std::string& type, const std::string& meaning) {
    route.query.push_back({std::string(name), type, meaning});
  };
  field(LinkSigner::kExpires, "integer", "Of a link: when it expires, in seconds since 1970.");
  field(LinkSigner::kKey, "string", "Of a link: id of the key that made it.");
  field(LinkSigner::kSignature, "string", "Of a link: stands for the key.");
  route.problems.insert(route.problems.end(), {code::kLinkExpired, code::kLinkInvalid});
}

bool is_linked(const Exchange& exchange, const Route* route) {
  return route != nullptr && route->can_be_linked() &&
         query_of(exchange.head).contains(std::string(LinkSigner::kSignature));
}

void follow_link(const LinkSigner& signer, const Gatekeeper& gate, Exchange& exchange) {
  const httplib::Params query = query_of(exchange.head);
  signer.check(exchange.path, query, std::chrono::system_clock::now());
  exchange.caller = gate.caller_of(LinkSigner::key_of(query));
  if (gate.keyed() && exchange.caller.key == nullptr) {
    throw Error(code::kLinkInvalid, "the key that made the link is not valid any more");
  }
  exchange.linked = true;
}

std::string without_signature(const std::string& target) {
  const auto query = target.find('?');
  if (query == std::string::npos) return target;
  const std::string text = percent_decoded(target.substr(query), true);
  return text.find(LinkSigner::kSignature) == std::string::npos ? target : target.substr(0, query) + "?...";
}

}  // namespace creased
