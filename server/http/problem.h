#pragma once

#include <string>

#include "core/error.h"
#include "server/http/library.h"

namespace creased {

/// The problem document [RFC 9457] of an error, without the members that say nothing.
std::string problem_json(const crease::Error& error, const std::string& request_id);

/// Makes `response` the answer to an error: status, document, and Retry-After where trying again helps.
void answer_problem(httplib::Response& response, const crease::Error& error, const std::string& request_id);

}  // namespace creased
