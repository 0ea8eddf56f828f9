#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace creased {

/// Limits on the head of a request.
struct HeadLimits {
  std::size_t max_bytes = 16 * 1024;
  std::size_t max_target_bytes = 8 * 1024;
  std::size_t max_headers = 64;
};

/// The head of a request, parsed strictly [RFC 9112]. Anything that a proxy and a server could interpret differently is
/// refused.
struct RequestHead {
  std::string method;
  std::string target;  ///< origin form: path and query
  std::string version;
  std::vector<std::pair<std::string, std::string>> headers;  ///< as sent, with trimmed values

  std::optional<std::uint64_t> content_length;
  bool chunked = false;
  bool keep_alive = true;
  bool expects_continue = false;

  std::size_t count(std::string_view name) const;
  /// The value of the first header with this name, ignoring case; empty when there is none.
  std::string_view header(std::string_view name) const;
  /// The target without its query.
  std::string_view path() const;
  bool has_body() const { return chunked || content_length.value_or(0) > 0; }
};

/// Parses a head, up to and including its empty line.
/// \throw crease::Error request_malformed, uri_too_long, headers_too_large, http_version_unsupported,
/// transfer_encoding_unsupported, expectation_failed
RequestHead parse_head(std::string_view bytes, const HeadLimits& limits);

/// The text with each "%" and two hexadecimal digits replaced by its byte. All else stays, such as "%u0041".
std::string percent_decoded(std::string_view text, bool plus_is_space);

/// Whether a line is a header field: a name, a colon, and a value without control characters.
bool is_field_line(std::string_view line);

}  // namespace creased
