#include "server/api/problem.h"

#include <nlohmann/json.hpp>

#include "proto/error_table.h"

namespace creased {
namespace {

bool is_queue(std::string_view code) { return code == "queue_full" || code == "key_queue_full"; }

/// Whether the same request may succeed later.
bool is_temporary(const crease::Error& error, int status) {
  return status == 503 || status == 429 || error.code() == "job_not_finished" || error.code() == "snapshot_unavailable";
}

}  // namespace

std::string problem_json(const crease::Error& error, const std::string& request_id) {
  const auto problem = crease::to_problem(error);
  nlohmann::ordered_json document = {
      {"type", problem.type()}, {"title", problem.title()}, {"status", problem.status()}, {"code", problem.code()}};
  for (const auto& [name, text] : {std::pair{"detail", &problem.detail()}, std::pair{"place", &problem.place()},
                                   std::pair{"field", &problem.field()}, std::pair{"value", &problem.value()},
                                   std::pair{"expected", &problem.expected()}}) {
    if (!text->empty()) document[name] = *text;
  }
  document["request_id"] = request_id;
  // The error may quote bytes of the client that are not UTF-8.
  return document.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

Refusal refusal(const crease::Error& error, const std::string& request_id) {
  const auto& kind = crease::error_kind(error.code());
  return {kind.status, std::string(kind.title), problem_json(error, request_id)};
}

void answer_problem(httplib::Response& response, const crease::Error& error, const std::string& request_id) {
  response.status = crease::error_kind(error.code()).status;
  response.set_content(problem_json(error, request_id), "application/problem+json");
  if (!response.has_header("Retry-After") && is_temporary(error, response.status)) {
    response.set_header("Retry-After", is_queue(error.code()) ? "5" : "1");
  }
}

}  // namespace creased
