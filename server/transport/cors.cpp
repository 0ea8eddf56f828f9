#include "server/transport/cors.h"

#include <algorithm>
#include <regex>

#include "core/base/text.h"

namespace creased {
namespace {

using crease::equals_ignoring_case;

constexpr const char* kMethods = "GET, HEAD, POST, DELETE";
constexpr const char* kRequestHeaders =
    "Authorization, Content-Type, Idempotency-Key, If-None-Match, If-Range, Last-Event-ID, Prefer, Range, X-Request-Id";
constexpr const char* kExposedHeaders =
    "Accept-Ranges, Content-Disposition, Content-Length, Content-Range, ETag, Idempotent-Replayed, Location, "
    "Preference-Applied, Retry-After, WWW-Authenticate, X-Request-Id";
constexpr const char* kPreflightSeconds = "600";

bool is_same_host(std::string_view origin, std::string_view host) {
  const auto authority = origin.find("://");
  return authority != std::string_view::npos && equals_ignoring_case(origin.substr(authority + 3), host);
}

}  // namespace

bool is_origin(std::string_view text) {
  static const std::regex pattern(R"(https?://(\[[0-9a-f:.]+\]|[a-z0-9.-]+)(:[0-9]{1,5})?)");
  return std::regex_match(text.begin(), text.end(), pattern);
}

bool CorsPolicy::allows(std::string_view origin) const {
  return std::any_of(origins_.begin(), origins_.end(),
                     [&](const std::string& allowed) { return allowed == "*" || allowed == origin; });
}

void CorsPolicy::add_headers(const RequestHead& head, httplib::Response& response) const {
  if (origins_.empty()) return;
  response.set_header("Vary", "Origin");
  const std::string_view origin = head.header("Origin");
  if (origin.empty() || !allows(origin)) return;
  response.set_header("Access-Control-Allow-Origin", std::string(origin));
  if (head.method == "OPTIONS" && head.count("Access-Control-Request-Method") > 0) {
    response.set_header("Access-Control-Allow-Methods", kMethods);
    response.set_header("Access-Control-Allow-Headers", kRequestHeaders);
    response.set_header("Access-Control-Max-Age", kPreflightSeconds);
  } else {
    response.set_header("Access-Control-Expose-Headers", kExposedHeaders);
  }
}

bool CorsPolicy::forbids(const RequestHead& head) const {
  const bool changes = head.method != "GET" && head.method != "HEAD" && head.method != "OPTIONS";
  if (!changes || head.count("Origin") == 0) return false;
  const std::string_view origin = head.header("Origin");
  return !is_same_host(origin, head.header("Host")) && !allows(origin);
}

}  // namespace creased
