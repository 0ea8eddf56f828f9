#include "client/cli/parameter_options.h"

#include <fmt/format.h>

#include <set>

#include "core/error.h"
#include "proto/parameter_table.h"

namespace crease::client {

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
  std::string help = "Parameters (-p name=value), with their defaults:\n";
  for (const ParameterInfo& info : parameter_table()) {
    help += fmt::format("  {}={}    {}{}\n      {}\n", info.name, info.default_text, info.expected(),
                        info.unit.empty() ? "" : ", in " + info.unit, info.meaning);
  }
  return help;
}

}  // namespace crease::client
