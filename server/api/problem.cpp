#include "server/api/problem.h"

#include <nlohmann/json.hpp>

#include "proto/error_table.h"

namespace creased {
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
  return {kind.status, std::string(kind.title), problem_json(error, request_id), kind.retry_after_s};
}

void answer_problem(httplib::Response& response, const crease::Error& error, const std::string& request_id) {
  const auto& kind = crease::error_kind(error.code());
  response.status = kind.status;
  response.set_content(problem_json(error, request_id), "application/problem+json");
  if (!response.has_header("Retry-After") && kind.retry_after_s > 0) {
    response.set_header("Retry-After", std::to_string(kind.retry_after_s));
  }
}

}  // namespace creased
