#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/api/route.h"

namespace creased {

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

}  // namespace creased
