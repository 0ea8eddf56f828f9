#pragma once

#include <spdlog/common.h>

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace creased {

/// Sends every spdlog message of this process to standard error, one line each. `format` is "text" or "json"; a JSON
/// line is one object with time, level, pid, message and the fields of log_event. Control characters never get through.
void configure_log(const std::string& format, const std::string& level);

/// A message with named values: `event key=value …` as text, members of the object as JSON.
void log_event(spdlog::level::level_enum level, std::string_view event, const nlohmann::ordered_json& fields);

/// Now, as RFC 3339 in UTC with milliseconds.
std::string timestamp_now();

}  // namespace creased
