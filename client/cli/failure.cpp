#include "client/cli/failure.h"

#include <fmt/format.h>

#include "client/cli/exit_code.h"
#include "proto/convert.h"
#include "proto/error_table.h"

namespace crease::client {
namespace {

using nlohmann::ordered_json;

std::string member_text(const ordered_json& problem, const char* member) {
  const auto found = problem.find(member);
  return found != problem.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// "code: detail (place)"
std::string sentence(const ordered_json& problem) {
  const std::string place = member_text(problem, "place");
  return fmt::format("{}: {}{}", member_text(problem, "code"), member_text(problem, "detail"),
                     place.empty() ? "" : " (" + place + ")");
}

ExitCode exit_code_of_problem(const ordered_json& problem) {
  const auto status = problem.find("status");
  return exit_code_of(member_text(problem, "code"),
                      status != problem.end() && status->is_number_integer() ? status->get<int>() : 0);
}

}  // namespace

Failure::Failure(ErrorCode code, const std::string& detail)
    : Failure(ordered_json{{"code", error_kind(code).name}, {"detail", detail}}) {}

Failure::Failure(const Error& error) : Failure(to_json(to_problem(error))) {}

Failure::Failure(const ordered_json& problem) : Failure(problem, exit_code_of_problem(problem)) {}

Failure::Failure(ordered_json problem, ExitCode exit_code)
    : std::runtime_error(sentence(problem)), problem_(std::move(problem)), exit_code_(exit_code) {}

}  // namespace crease::client
