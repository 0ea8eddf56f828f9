#include "server/api/routes.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/error.h"
#include "core/options/parameters.h"
#include "server/api/events.h"
#include "server/api/jobs.h"
#include "server/api/links.h"
#include "server/api/page.h"
#include "server/api/results.h"
#include "server/api/samples.h"
#include "server/api/service.h"
#include "server/api/submit.h"

namespace creased {
namespace code = crease::code;
namespace {

using crease::Error;

constexpr std::size_t kMaxIdBytes = 64;

bool match_path(std::string_view pattern, std::string_view path, std::string& id) {
  const auto brace = pattern.find('{');
  if (brace == std::string_view::npos) return pattern == path;
  const std::string_view before = pattern.substr(0, brace), after = pattern.substr(pattern.find('}') + 1);
  if (path.size() <= before.size() + after.size() || !path.starts_with(before) || !path.ends_with(after)) return false;
  const std::string_view middle = path.substr(before.size(), path.size() - before.size() - after.size());
  if (middle.size() > kMaxIdBytes || middle.find('/') != std::string_view::npos) return false;
  id = middle;
  return true;
}

/// The format behind the dot at the end of `path`, where the route has that format.
std::string format_at_end(const Route& route, std::string_view path) {
  const std::size_t dot = path.rfind('.');
  if (dot == std::string_view::npos) return {};
  std::string format(path.substr(dot + 1));
  const auto field = std::ranges::find(route.query, "format", &QueryField::name);
  if (field == route.query.end() || std::ranges::find(field->values, format) == field->values.end()) return {};
  return format;
}

bool matches(const Route& route, std::string_view path, RouteMatch& match) {
  if (match_path(route.path, path, match.id)) return true;
  const std::string format = format_at_end(route, path);
  if (format.empty() || !match_path(route.path, path.substr(0, path.size() - format.size() - 1), match.id))
    return false;
  match.format = format;
  return true;
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string known_names(const Route& route) {
  std::vector<std::string> names;
  for (const auto& field : route.query) names.push_back(field.name);
  if (route.takes_parameters()) names.emplace_back("a parameter listed by GET /v1/parameters");
  return names.empty() ? "no query fields" : "one of " + joined(names);
}

bool is_parameter(const std::string& name) {
  const auto& table = crease::parameter_table();
  return std::any_of(table.begin(), table.end(), [&](const auto& info) { return info.name == name; });
}

void check_value(const QueryField& field, const std::string& value) {
  if (!field.values.empty() && std::find(field.values.begin(), field.values.end(), value) == field.values.end()) {
    throw Error::parameter(code::kParameterInvalid, field.name, value, "one of " + joined(field.values));
  }
  if (field.type == "boolean" && value != "true" && value != "false") {
    throw Error::parameter(code::kParameterInvalid, field.name, value, "true or false");
  }
  if (field.type != "integer" && field.type != "number") return;
  const std::string expected =
      fmt::format("a{} {} from {} to {}", field.type == "integer" ? "n" : "", field.type, field.min, field.max);
  double number = 0;
  const char* const end = value.data() + value.size();
  const auto [stop, error] = std::from_chars(value.data(), end, number);
  if (error != std::errc() || stop != end || !std::isfinite(number) ||
      (field.type == "integer" && number != std::floor(number))) {
    throw Error::parameter(code::kParameterInvalid, field.name, value, expected);
  }
  if (number < field.min || number > field.max) {
    throw Error::parameter(code::kParameterOutOfRange, field.name, value, expected);
  }
}

std::vector<Route> make_routes() {
  std::vector<Route> all;
  for (auto&& part : {submit_routes(), job_routes(), event_routes(), result_routes(), link_routes(), service_routes(),
                      page_routes(), sample_routes()}) {
    all.insert(all.end(), part.begin(), part.end());
  }
  for (auto& route : all) {
    if (route.can_be_linked()) add_link_fields(route);
  }
  return all;
}

}  // namespace

const Route& route_of(std::string_view operation) { return *std::ranges::find(routes(), operation, &Route::operation); }

std::span<const Route> routes() {
  static const std::vector<Route> table = make_routes();
  return table;
}

RouteMatch match_route(std::string_view method, std::string_view path) {
  RouteMatch match;
  for (const auto& route : routes()) {
    if (!matches(route, path, match)) continue;
    match.allowed.push_back(route.method);
    if (route.method == "GET") match.allowed.emplace_back("HEAD");
    if (route.method == method || (method == "HEAD" && route.method == "GET")) match.route = &route;
  }
  if (!match.allowed.empty()) match.allowed.emplace_back("OPTIONS");
  return match;
}

void check_query(const Route& route, const httplib::Params& query) {
  for (const auto& [name, value] : query) {
    if (query.count(name) > 1) throw Error::parameter(code::kParameterInvalid, name, value, "a single value");
    const auto field = std::find_if(route.query.begin(), route.query.end(),
                                    [&, &key = name](const QueryField& known) { return known.name == key; });
    if (field != route.query.end()) {
      check_value(*field, value);
    } else if (!route.takes_parameters() || !is_parameter(name)) {
      throw Error::parameter(code::kParameterUnknown, name, value, known_names(route));
    }
  }
  for (const auto& field : route.query) {
    if (!field.required || query.contains(field.name)) continue;
    const std::string expected = field.values.empty() ? "a " + field.type : "one of " + joined(field.values);
    throw Error::parameter(code::kParameterInvalid, field.name, "", expected);
  }
}

}  // namespace creased
