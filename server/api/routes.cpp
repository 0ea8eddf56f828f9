#include "server/api/routes.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/error.h"
#include "core/options/parameters.h"
#include "proto/result_formats.h"

namespace creased {
namespace {

using crease::Error;

constexpr std::size_t kMaxIdBytes = 64;

const std::string kJson = "application/json";

std::vector<std::string> names(const crease::Formats& formats) {
  std::vector<std::string> names;
  for (const auto* format : formats) names.emplace_back(format->name);
  return names;
}

std::vector<std::string> media_types(const crease::Formats& formats) {
  std::vector<std::string> types;
  for (const auto* format : formats) types.emplace_back(format->media_types.front());
  return types;
}

std::vector<std::string> submit_problems() {
  return {"mesh_count_mismatch", "mesh_empty",           "mesh_format_unknown",    "mesh_index_out_of_range",
          "mesh_no_extent",      "mesh_no_faces",        "mesh_not_finite",        "mesh_syntax",
          "mesh_too_large",      "mesh_truncated",       "mesh_unsupported",       "inspection_failed",
          "body_missing",        "body_incomplete",      "payload_too_large",      "content_type_unsupported",
          "json_invalid",        "multipart_invalid",    "multipart_part_missing", "multipart_part_unknown",
          "protobuf_invalid",    "idempotency_conflict", "parameter_invalid",      "parameter_out_of_range",
          "queue_full",          "key_queue_full",       "quota_exceeded",         "storage_full",
          "store_unavailable",   "shutting_down",        "weights_invalid",        "process_unavailable"};
}

Route submit_route() {
  return {
      "POST",
      "/v1/jobs",
      "submit_job",
      "Submit a mesh for smoothing",
      {{"name", "string", "File name of the mesh. It is shown in lists, and its extension may tell the format."},
       {"format", "string", "Format of the mesh. By default it is found from the media type, the name, then the bytes.",
        names(crease::formats_with(&crease::Format::read))}},
      {{202, "The job is accepted. Location is its path.", {kJson}, "Job"},
       {200, "The job ended within the time that `Prefer: wait` allowed.", {kJson}, "Job"}},
      submit_problems()};
}

std::vector<Route> job_routes() {
  return {
      {"GET",
       "/v1/jobs",
       "list_jobs",
       "List jobs, newest first",
       {{"state", "string", "Only jobs in this state.", {"queued", "running", "succeeded", "failed", "cancelled"}},
        {"limit", "integer", "Number of jobs on a page.", {}, 1, 1000},
        {"cursor", "string", "Start of the page: next_cursor of the page before."}},
       {{200, "A page of jobs.", {kJson}, "JobList"}},
       {"parameter_invalid", "parameter_out_of_range"}},
      {"GET",
       "/v1/jobs/{id}",
       "get_job",
       "Get a job: state, input, parameters, progress, result",
       {},
       {{200, "The job.", {kJson}, "Job"}},
       {"job_not_found"}},
      {"DELETE",
       "/v1/jobs/{id}",
       "delete_job",
       "Delete a job and all its data",
       {},
       {{204, "The job is deleted.", {}, ""}},
       {"job_not_found"}},
      {"POST",
       "/v1/jobs/{id}/cancel",
       "cancel_job",
       "Cancel a job",
       {},
       {{202, "The job will stop within one sweep.", {kJson}, "Job"},
        {200, "The job had already ended.", {kJson}, "Job"}},
       {"job_not_found"}},
      {"GET",
       "/v1/jobs/{id}/events",
       "watch_job",
       "Follow a job as server-sent events: progress, then succeeded, failed or cancelled",
       {},
       {{200, "The events.", {"text/event-stream"}, ""}, {204, "There are no events after Last-Event-ID.", {}, ""}},
       {"job_not_found", "key_streams_full", "too_many_streams", "shutting_down"}},
  };
}

std::vector<Route> result_routes() {
  const std::vector<std::string> unfinished = {"job_not_found", "result_damaged", "job_not_finished",
                                               "job_failed",    "job_cancelled",  "parameter_invalid"};
  auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), unfinished.begin(), unfinished.end());
    return more;
  };
  return {
      {"GET",
       "/v1/jobs/{id}/mesh",
       "get_mesh",
       "Download the smoothed mesh",
       {{"format", "string",
         "Format of the mesh; the path may end in it instead: mesh.glb. By default the Accept header decides, or "
         "else it is glb.",
         names(crease::mesh_formats())},
        {"snapshot", "boolean", "While the job is running, its latest intermediate mesh."},
        {"measured", "boolean",
         "The measured positions in place of the smoothed ones, with the same vertices, faces and splits as the "
         "result."}},
       {{200, "The mesh.", media_types(crease::mesh_formats()), "LabelledMesh"},
        {206, "A range of its bytes.", media_types(crease::mesh_formats()), "LabelledMesh"},
        {304, "The mesh in If-None-Match is current.", {}, ""}},
       with({"not_acceptable", "range_not_satisfiable", "snapshot_unavailable"})},
      {"GET",
       "/v1/jobs/{id}/labels",
       "get_labels",
       "Download the ridge label and the signed dihedral angle of every edge",
       {{"format", "string", "Format of the labels; the path may end in it instead: labels.csv.",
         names(crease::label_formats())},
        {"min", "number", "Only edges with a label of at least this.", {}, 0, 1}},
       {{200, "The labels.", media_types(crease::label_formats()), "EdgeLabels"},
        {206, "A range of their bytes.", media_types(crease::label_formats()), ""},
        {304, "The labels in If-None-Match are current.", {}, ""}},
       with({"range_not_satisfiable", "parameter_out_of_range"})},
      {"GET",
       "/v1/jobs/{id}/ridges",
       "get_ridges",
       "Download the ridge lines and the corners where they meet",
       {{"format", "string",
         "Format of the ridge lines; the path may end in it instead: ridges.glb. By default the Accept header "
         "decides, or else it is json.",
         names(crease::ridge_formats())}},
       {{200, "The ridge lines.", media_types(crease::ridge_formats()), "RidgeLines"},
        {206, "A range of their bytes.", media_types(crease::ridge_formats()), ""},
        {304, "The ridge lines in If-None-Match are current.", {}, ""}},
       with({"not_acceptable", "range_not_satisfiable"})},
      {"GET",
       "/v1/jobs/{id}/report",
       "get_report",
       "Download the report: input facts, parameters, energies of every sweep, result, timings",
       {{"format", "string", "Format of the report; the path may end in it instead: report.json.",
         names(crease::report_formats())}},
       {{200, "The report.", media_types(crease::report_formats()), "Report"}},
       with({})},
  };
}

std::vector<Route> service_routes() {
  return {
      {"GET",
       "/v1/parameters",
       "get_parameters",
       "List the parameters as JSON Schema, with unit, range, default and meaning",
       {},
       {{200, "JSON Schema.", {"application/schema+json"}, ""}},
       {}},
      {"GET",
       "/v1/samples/{name}",
       "get_sample",
       "Download a mesh to try the service with: part.ply, a machined part, or scan.ply, a scan",
       {},
       {{200, "The mesh.", {"model/ply"}, ""}},
       {"not_found"}},
      {"GET",
       "/healthz",
       "get_health",
       "Check that the process is alive",
       {},
       {{200, "The process is alive.", {kJson}, ""}},
       {},
       Access::kProbe},
      {"GET",
       "/readyz",
       "get_readiness",
       "Check that the service accepts jobs",
       {},
       {{200, "The service accepts jobs.", {kJson}, ""}},
       {"shutting_down", "store_unavailable"},
       Access::kProbe},
      {"GET",
       "/metrics",
       "get_metrics",
       "Metrics in the Prometheus text format",
       {},
       {{200, "The metrics.", {"text/plain"}, ""}},
       {"forbidden"},
       Access::kMetrics},
      {"GET", "/", "get_page", "The workbench, a page", {}, {{200, "The page.", {"text/html"}, ""}}, {}, Access::kOpen},
      {"GET",
       "/docs",
       "get_docs",
       "This OpenAPI document as a page",
       {},
       {{200, "The page.", {"text/html"}, ""}},
       {},
       Access::kOpen},
      {"GET",
       "/assets/{name}",
       "get_asset",
       "A file of the page",
       {},
       {{200, "The file.", {"text/javascript", "text/css", "image/svg+xml"}, ""}},
       {"not_found"},
       Access::kOpen},
      {"GET",
       "/openapi.json",
       "get_openapi",
       "This OpenAPI document",
       {},
       {{200, "The OpenAPI 3.1 document.", {"application/vnd.oai.openapi+json"}, ""}},
       {},
       Access::kOpen},
  };
}

Route link_route() {
  std::vector<std::string> formats;
  for (const auto& of_part :
       {crease::mesh_formats(), crease::label_formats(), crease::ridge_formats(), crease::report_formats()}) {
    for (const auto& name : names(of_part)) {
      if (std::ranges::find(formats, name) == formats.end()) formats.push_back(name);
    }
  }
  std::vector<std::string> targets;
  for (const auto& target : link_targets()) targets.push_back(target.name);
  return {"POST",
          "/v1/jobs/{id}/links",
          "create_link",
          "Make a link that reads one part of a job without a key, for some time",
          {{.name = "result",
            .type = "string",
            .meaning = "What the link reads.",
            .values = std::move(targets),
            .required = true},
           {"format", "string", "Format of the mesh, the labels, the ridges or the report.", std::move(formats)},
           {"snapshot", "boolean", "As for the mesh itself."},
           {"measured", "boolean", "As for the mesh itself."},
           {"min", "number", "As for the labels themselves.", {}, 0, 1},
           {"expires_in", "integer", "Seconds until the link expires; a day by default.", {}, 1, 30.0 * 86'400}},
          {{201, "The link.", {kJson}, "Link"}},
          {"job_not_found", "parameter_invalid", "parameter_out_of_range"}};
}

/// Adds what a route has that can be linked: the fields of a link, and its problems.
void add_link_fields(Route& route) {
  route.query.push_back({"expires", "integer", "Of a link: when it expires, in seconds since 1970."});
  route.query.push_back({"key", "string", "Of a link: id of the key that made it."});
  route.query.push_back({"signature", "string", "Of a link: stands for the key."});
  route.problems.insert(route.problems.end(), {"link_expired", "link_invalid"});
}

std::vector<Route> make_routes() {
  std::vector<Route> all = {submit_route()};
  for (auto&& part : {job_routes(), result_routes(), std::vector{link_route()}, service_routes()})
    all.insert(all.end(), part.begin(), part.end());
  for (auto& route : all) {
    if (route.can_be_linked()) add_link_fields(route);
  }
  return all;
}

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
    throw Error::parameter("parameter_invalid", field.name, value, "one of " + joined(field.values));
  }
  if (field.type == "boolean" && value != "true" && value != "false") {
    throw Error::parameter("parameter_invalid", field.name, value, "true or false");
  }
  if (field.type != "integer" && field.type != "number") return;
  const std::string expected =
      fmt::format("a{} {} from {} to {}", field.type == "integer" ? "n" : "", field.type, field.min, field.max);
  double number = 0;
  const char* const end = value.data() + value.size();
  const auto [stop, error] = std::from_chars(value.data(), end, number);
  if (error != std::errc() || stop != end || !std::isfinite(number) ||
      (field.type == "integer" && number != std::floor(number))) {
    throw Error::parameter("parameter_invalid", field.name, value, expected);
  }
  if (number < field.min || number > field.max) {
    throw Error::parameter("parameter_out_of_range", field.name, value, expected);
  }
}

}  // namespace

const std::vector<LinkTarget>& link_targets() {
  static const std::vector<LinkTarget> targets = {{"job", "get_job"},       {"events", "watch_job"},
                                                  {"mesh", "get_mesh"},     {"labels", "get_labels"},
                                                  {"ridges", "get_ridges"}, {"report", "get_report"}};
  return targets;
}

bool Route::can_be_linked() const {
  return std::ranges::find(link_targets(), operation, &LinkTarget::operation) != link_targets().end();
}

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
    if (query.count(name) > 1) throw Error::parameter("parameter_invalid", name, value, "a single value");
    const auto field = std::find_if(route.query.begin(), route.query.end(),
                                    [&, &key = name](const QueryField& known) { return known.name == key; });
    if (field != route.query.end()) {
      check_value(*field, value);
    } else if (!route.takes_parameters() || !is_parameter(name)) {
      throw Error::parameter("parameter_unknown", name, value, known_names(route));
    }
  }
  for (const auto& field : route.query) {
    if (!field.required || query.contains(field.name)) continue;
    const std::string expected = field.values.empty() ? "a " + field.type : "one of " + joined(field.values);
    throw Error::parameter("parameter_invalid", field.name, "", expected);
  }
}

std::string query_value(const httplib::Params& query, const std::string& name, const std::string& fallback) {
  const auto found = query.find(name);
  return found == query.end() ? fallback : found->second;
}

double query_number(const httplib::Params& query, const std::string& name, double fallback) {
  const auto found = query.find(name);
  if (found != query.end()) {
    std::from_chars(found->second.data(), found->second.data() + found->second.size(), fallback);
  }
  return fallback;
}

bool query_flag(const httplib::Params& query, const std::string& name) { return query_value(query, name) == "true"; }

}  // namespace creased
