#pragma once

#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/library.h"

namespace creased {

/// A name that a route's query may have.
struct QueryField {
  std::string name;
  std::string type;  ///< "string", "integer", "number", "boolean"
  std::string meaning;
  std::vector<std::string> values = {};  ///< what a string may be; empty: anything
  double min = 0, max = std::numeric_limits<double>::max();
};

/// What a route answers when all is well.
struct RouteAnswer {
  int status;
  std::string meaning;
  std::vector<std::string> media_types;
  std::string schema;  ///< component of the OpenAPI document for JSON; empty: none
};

/// Who may make a call where the service has keys.
enum class Access {
  kKey,      ///< who has one
  kOpen,     ///< anyone
  kProbe,    ///< anyone, and as often as they like
  kMetrics,  ///< this machine, or who has a key that says so
};

/// One call of the API. Dispatch, the check of queries and the OpenAPI document are all made from this table.
struct Route {
  std::string method;
  std::string path;  ///< with {id} for the job's id
  std::string operation;
  std::string summary;
  std::vector<QueryField> query;
  std::vector<RouteAnswer> answers;
  std::vector<std::string> problems;  ///< codes, beside those that any call can meet
  Access access = Access::kKey;

  bool takes_parameters() const { return operation == "submit_job"; }
};

/// Every call, in the order of the documentation.
std::span<const Route> routes();

struct RouteMatch {
  const Route* route = nullptr;  ///< null: no such path, or not with this method
  std::string id;
  std::vector<std::string> allowed;  ///< methods of the path; empty: no such path
};

/// HEAD is matched where GET is.
RouteMatch match_route(std::string_view method, std::string_view path);

/// Refuses names that the route does not know, names given twice, and values outside the field's type and range.
/// \throw crease::Error parameter_unknown, parameter_invalid, parameter_out_of_range
void check_query(const Route& route, const httplib::Params& query);

/// The value of a query field; `otherwise` when it is not given.
std::string query_value(const httplib::Params& query, const std::string& name, const std::string& otherwise = {});
double query_number(const httplib::Params& query, const std::string& name, double otherwise);
bool query_flag(const httplib::Params& query, const std::string& name);

}  // namespace creased
