#pragma once

#include <spdlog/common.h>

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace creased {

/// Sends every spdlog message of this process to standard error, one line each. `format` is "text" or "json"; a JSON
/// line is an object with time, level, pid, message and the fields of log_event. Control characters are escaped.
void configure_log(const std::string& format, const std::string& level);

/// Logs a message with named values: `event key=value …` in text, members of the object in JSON.
void log_event(spdlog::level::level_enum level, std::string_view event, const nlohmann::ordered_json& fields);

/// The current time in RFC 3339 form, in UTC with milliseconds.
std::string timestamp_now();

}  // namespace creased
