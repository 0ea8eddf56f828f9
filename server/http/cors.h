#pragma once

#include <string>
#include <vector>

#include "server/http/http_head.h"
#include "server/http/library.h"

namespace creased {

/// Which pages of other origins may call the service from a browser: those of a list, and without one none.
class CorsPolicy {
 public:
  /// `origins` as browsers send them; "*" is any.
  explicit CorsPolicy(std::vector<std::string> origins) : origins_(std::move(origins)) {}

  /// What lets the page that a request comes from read the answer, when it is on the list.
  void add_headers(const RequestHead& head, httplib::Response& response) const;
  /// Whether a page that is neither ours nor on the list is about to change something. Browsers send forms anywhere
  /// without asking first.
  bool forbids(const RequestHead& head) const;

 private:
  bool allows(std::string_view origin) const;

  std::vector<std::string> origins_;
};

/// Whether the text is an origin: scheme, host and perhaps port, in lower case and nothing after.
bool is_origin(std::string_view text);

}  // namespace creased
