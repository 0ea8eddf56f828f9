#pragma once

#include <string>
#include <vector>

#include "server/transport/http_head.h"
#include "server/transport/library.h"

namespace creased {

/// Decides which web pages of other origins may call the service: those whose origin is listed.
class CorsPolicy {
 public:
  /// `origins` are written as browsers send them; "*" allows any.
  explicit CorsPolicy(std::vector<std::string> origins) : origins_(std::move(origins)) {}

  /// Adds the headers that let a page with an allowed origin read the answer.
  void add_headers(const RequestHead& head, httplib::Response& response) const;
  /// Whether to refuse a request that changes something because its page has a foreign origin that is not listed.
  /// Browsers submit forms across origins without a preflight request.
  bool forbids(const RequestHead& head) const;

 private:
  bool allows(std::string_view origin) const;

  std::vector<std::string> origins_;
};

/// Whether the text is an origin: scheme, host and an optional port, all in lower case.
bool is_origin(std::string_view text);

}  // namespace creased
