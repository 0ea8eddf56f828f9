#pragma once

#include <string>

#include "core/error.h"
#include "server/transport/guarded_server.h"
#include "server/transport/library.h"

namespace creased {

/// The problem document [RFC 9457] of an error, without empty members.
std::string problem_json(const crease::Error& error, const std::string& request_id);

/// What answers a request that is refused before it reaches a handler.
Refusal refusal(const crease::Error& error, const std::string& request_id);

/// Turns `response` into the answer to an error: status, problem document, and Retry-After when trying again may help.
void answer_problem(httplib::Response& response, const crease::Error& error, const std::string& request_id);

}  // namespace creased
