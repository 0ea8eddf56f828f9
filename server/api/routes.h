#pragma once

#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/transport/library.h"

namespace creased {

/// A field that a route's query may have.
struct QueryField {
  std::string name;
  std::string type;  ///< "string", "integer", "number", "boolean"
  std::string meaning;
  std::vector<std::string> values = {};  ///< allowed strings; empty for any
  double min = 0, max = std::numeric_limits<double>::max();
  bool required = false;
};

/// An answer of a route when it succeeds.
struct RouteAnswer {
  int status;
  std::string meaning;
  std::vector<std::string> media_types;
  std::string schema;  ///< schema in the OpenAPI document, for JSON; empty for none
};

/// Who may call a route on a service that has keys.
enum class Access {
  kKey,      ///< anyone with a key
  kOpen,     ///< anyone
  kProbe,    ///< anyone, without a rate limit
  kMetrics,  ///< this machine, and keys that allow it
};

/// One route of the API. Dispatch, the check of queries and the OpenAPI document all come from the table of routes.
struct Route {
  std::string method;
  std::string path;  ///< {id} stands for the id of a job, {name} for the name of a file
  std::string operation;
  std::string summary;
  std::vector<QueryField> query;
  std::vector<RouteAnswer> answers;
  std::vector<std::string> problems;  ///< error codes, besides those that any call can have
  Access access = Access::kKey;

  bool takes_parameters() const { return operation == "submit_job"; }
  /// Whether a signature in its query may stand for the key.
  bool can_be_linked() const;
  bool has_ranges() const { return operation == "get_mesh" || operation == "get_labels" || operation == "get_ridges"; }
};

/// What a link can read, and the operation that answers it.
struct LinkTarget {
  std::string name, operation;
};
const std::vector<LinkTarget>& link_targets();

/// The route with this operation, which must exist.
const Route& route_of(std::string_view operation);

/// All routes, in the order of the documentation.
std::span<const Route> routes();

struct RouteMatch {
  const Route* route = nullptr;      ///< null when there is no such path or method
  std::string id;                    ///< what stands for {id} or {name}
  std::string format;                ///< at the end of the path, as in /v1/jobs/{id}/mesh.glb; empty for none
  std::vector<std::string> allowed;  ///< methods of the path; empty when there is no such path
};

/// Finds the route of a request. HEAD matches wherever GET does. A route with a query field "format" also matches with
/// a dot and one of the formats behind its path.
RouteMatch match_route(std::string_view method, std::string_view path);

/// Refuses unknown, repeated and missing names, and values outside a field's type or range.
/// \throw crease::Error parameter_unknown, parameter_invalid, parameter_out_of_range
void check_query(const Route& route, const httplib::Params& query);

/// The value of a query field, or `fallback` when it is missing.
std::string query_value(const httplib::Params& query, const std::string& name, const std::string& fallback = {});
double query_number(const httplib::Params& query, const std::string& name, double fallback);
bool query_flag(const httplib::Params& query, const std::string& name);

}  // namespace creased
