#pragma once

#include <string>
#include <vector>

#include "server/api/route.h"

namespace creased {

/// What a link can read, and the operation that answers it.
struct LinkTarget {
  std::string name, operation;
};
const std::vector<LinkTarget>& link_targets();

/// Makes signed addresses of single parts of a job.
std::vector<Route> link_routes();

/// Adds what a route has that can be linked: the fields of a link, and its problems.
void add_link_fields(Route& route);

/// Lets a request in whose query is signed: it is a call of the key that made the link.
/// \throw crease::Error link_invalid, also when that key is revoked, link_expired
void follow_link(const LinkSigner& signer, const Gatekeeper& gate, Exchange& exchange);

/// Whether the request comes by a link: its query has a signature, and its route may be linked.
bool is_linked(const Exchange& exchange, const Route* route);

/// The target of a request as it is logged: without the query of a link.
std::string without_signature(const std::string& target);

}  // namespace creased
