#pragma once

#include <limits>
#include <string>
#include <vector>

#include "core/io/formats.h"
#include "server/api/call.h"

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
  std::vector<crease::ErrorCode> problems;  ///< besides those that any call can have
  void (*answer)(Services&, Call&);
  Access access = Access::kKey;

  bool takes_parameters() const { return operation == "submit_job"; }
  /// Whether a signature in its query may stand for the key.
  bool can_be_linked() const;
  bool has_ranges() const { return operation == "get_mesh" || operation == "get_labels" || operation == "get_ridges"; }
};

/// Media type of what is sent as JSON.
inline const std::string kJson = "application/json";

/// The names of formats, and for each its first media type.
std::vector<std::string> format_names(const crease::Formats& formats);
std::vector<std::string> media_types(const crease::Formats& formats);

}  // namespace creased
