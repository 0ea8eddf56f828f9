#include "client/cli/parameter_options.h"

#include <fmt/format.h>

#include <map>
#include <set>
#include <string_view>

#include "core/error.h"
#include "proto/parameter_table.h"

namespace crease::client {
namespace {

/// What differs from method to method, one line each.
std::string by_method(const Parameter& parameter) {
  std::string lines;
  for (const ParameterPlace& place : parameter.places) {
    lines += fmt::format("      {}: {}, {}\n", method_names().at(*place.method),
                         text_of(default_value(parameter, place)), range_text(place));
  }
  return lines;
}

std::string help_of(const Parameter& parameter) {
  const auto common = parameter.common_default();
  const std::string where = text_of(conditions_of(parameter));
  std::string help =
      fmt::format("  {}{}    {}{}{}\n      {}\n", parameter.name, common ? "=" + text_of(*common) : "",
                  parameter.expected(), parameter.unit.empty() ? "" : fmt::format(", in {}", parameter.unit),
                  where.empty() ? "" : fmt::format("; with {}", where), parameter.meaning);
  if (!common || !parameter.has_common_range()) help += by_method(parameter);
  return help;
}

}  // namespace

v1::Parameters ParameterOptions::read() const {
  std::vector<std::string> all = assignments;
  if (!seed.empty()) all.push_back("seed=" + seed);
  if (!threads.empty()) all.push_back("threads=" + threads);

  v1::Parameters parameters;
  std::set<std::string> names;
  for (const std::string& assignment : all) {
    const auto equals = assignment.find('=');
    if (equals == std::string::npos) {
      throw Error::parameter(code::kParameterInvalid, assignment, "", "name=value");
    }
    const std::string name = assignment.substr(0, equals), value = assignment.substr(equals + 1);
    if (!names.insert(name).second) {
      throw Error::parameter(code::kParameterInvalid, name, value, "a single value");
    }
    set_parameter(parameters, name, value);
  }
  return parameters;
}

void add_parameter_options(CLI::App& command, ParameterOptions& options) {
  command.add_option("-p,--parameter", options.assignments, "Set a parameter; may be repeated")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  command.add_option("--seed", options.seed, "Same as -p seed=N")->type_name("N");
  command.add_option("--threads", options.threads, "Same as -p threads=N")->type_name("N");
  command.footer(parameter_help);
}

std::string parameter_help() {
  std::map<std::string_view, std::string> texts;
  std::vector<std::string_view> groups;
  for (const Parameter& parameter : parameter_table()) {
    std::string& text = texts[parameter.group];
    if (text.empty()) groups.push_back(parameter.group);
    text += help_of(parameter);
  }
  std::string help = "Parameters (-p name=value), with their defaults:\n";
  for (const std::string_view group : groups) help += fmt::format("\n{}:\n{}", group, texts[group]);
  return help;
}

}  // namespace crease::client
