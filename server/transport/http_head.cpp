#include "server/transport/http_head.h"

#include <arpa/inet.h>

#include <algorithm>
#include <cctype>
#include <charconv>

#include "core/base/text.h"
#include "core/error.h"

namespace creased {
namespace code = crease::code;
namespace {

using crease::equals_ignoring_case;
using crease::trimmed;

[[noreturn]] void malformed(const std::string& detail) { throw crease::Error(code::kRequestMalformed, detail); }

bool is_token_char(unsigned char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
         std::string_view("!#$%&'*+-.^_`|~").find(static_cast<char>(c)) != std::string_view::npos;
}

bool is_token(std::string_view text) { return !text.empty() && std::all_of(text.begin(), text.end(), is_token_char); }

bool is_field_text(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](unsigned char c) { return c == '\t' || (c >= 0x20 && c != 0x7f); });
}

std::string_view take_line(std::string_view& rest) {
  const auto end = rest.find("\r\n");
  if (end == std::string_view::npos) malformed("a line of the head does not end in CRLF");
  const std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end + 2);
  return line;
}

bool is_digit(unsigned char c) { return c >= '0' && c <= '9'; }

bool is_host_char(unsigned char c) {
  return is_digit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
         std::string_view("-._~!$&'()*+;=%").find(static_cast<char>(c)) != std::string_view::npos;
}

/// Whether the text can be the authority of an http URL or a Host header [RFC 3986 §3.2], without user information: a
/// name or an address, and maybe a port.
bool is_authority(std::string_view text) {
  std::string_view port;
  if (text.starts_with('[')) {
    const auto end = text.find(']');
    in6_addr address{};
    if (end == std::string_view::npos) return false;
    if (::inet_pton(AF_INET6, std::string(text.substr(1, end - 1)).c_str(), &address) != 1) return false;
    port = text.substr(end + 1);
  } else {
    const auto end = std::min(text.find(':'), text.size());
    if (!std::all_of(text.begin(), text.begin() + end, is_host_char)) return false;
    port = text.substr(end);
  }
  return port.empty() || (port.front() == ':' && std::all_of(port.begin() + 1, port.end(), is_digit));
}

std::string origin_form(std::string_view target) {
  constexpr std::string_view kScheme = "http://";
  if (target.starts_with("/") || target == "*") return std::string(target);
  if (!equals_ignoring_case(target.substr(0, kScheme.size()), kScheme)) {
    malformed("the request target is not a path or an http URL");
  }
  target.remove_prefix(kScheme.size());
  const auto end = std::min(target.find_first_of("/?"), target.size());
  if (end == 0 || !is_authority(target.substr(0, end))) malformed("the URL of the request has no valid host");
  target.remove_prefix(end);
  return target.starts_with("/") ? std::string(target) : "/" + std::string(target);
}

void parse_request_line(std::string_view line, const HeadLimits& limits, RequestHead& head) {
  const auto first = line.find(' ');
  const auto last = line.rfind(' ');
  if (first == std::string_view::npos || first == last) malformed("the request line does not have three parts");
  const std::string_view method = line.substr(0, first), target = line.substr(first + 1, last - first - 1);
  const std::string_view version = line.substr(last + 1);
  if (!is_token(method)) malformed("the method is not a token");
  if (target.size() > limits.max_target_bytes) {
    throw crease::Error(code::kUriTooLong,
                        "the target is longer than " + std::to_string(limits.max_target_bytes) + " bytes");
  }
  const auto visible = [](unsigned char c) { return c > 0x20 && c < 0x7f; };
  if (target.empty() || !std::all_of(target.begin(), target.end(), visible)) {
    malformed("the target has characters that must be percent-encoded");
  }
  if (!version.starts_with("HTTP/")) malformed("the request line does not end in an HTTP version");
  if (version != "HTTP/1.1" && version != "HTTP/1.0") {
    throw crease::Error(code::kHttpVersionUnsupported, "this server supports HTTP/1.1 and HTTP/1.0");
  }
  head.method = method;
  head.target = origin_form(target.substr(0, target.find('#')));
  head.version = version;
}

void parse_field(std::string_view line, RequestHead& head) {
  if (line.front() == ' ' || line.front() == '\t') malformed("a header continues on a second line");
  const auto colon = line.find(':');
  if (colon == std::string_view::npos || !is_token(line.substr(0, colon))) malformed("a header has no valid name");
  const std::string_view value = trimmed(line.substr(colon + 1));
  if (!is_field_text(value)) malformed("a header has control characters");
  head.headers.emplace_back(line.substr(0, colon), value);
}

std::uint64_t parse_length(std::string_view text) {
  std::uint64_t length = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), length);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) {
    malformed("Content-Length is not a number of bytes");
  }
  return length;
}

/// Refuses repeated headers of which a proxy and a server could each use a different one.
void refuse_repetition(const RequestHead& head) {
  for (const std::string name : {"Authorization", "Content-Encoding", "Content-Type", "Origin"}) {
    if (head.count(name) > 1) malformed("there is more than one " + name);
  }
}

void settle_framing(RequestHead& head) {
  const std::size_t lengths = head.count("Content-Length"), encodings = head.count("Transfer-Encoding");
  if (lengths > 1) malformed("there is more than one Content-Length");
  if (lengths == 1 && encodings > 0) malformed("Content-Length and Transfer-Encoding contradict each other");
  if (lengths == 1) head.content_length = parse_length(head.header("Content-Length"));
  if (encodings == 0) return;
  if (head.version == "HTTP/1.0") malformed("an HTTP/1.0 request may not have Transfer-Encoding");
  if (encodings > 1 || !equals_ignoring_case(head.header("Transfer-Encoding"), "chunked")) {
    throw crease::Error(code::kTransferEncodingUnsupported, "the only supported transfer encoding is chunked");
  }
  head.chunked = true;
}

bool lists_token(std::string_view list, std::string_view token) {
  while (!list.empty()) {
    const auto comma = std::min(list.find(','), list.size());
    if (equals_ignoring_case(trimmed(list.substr(0, comma)), token)) return true;
    list.remove_prefix(std::min(comma + 1, list.size()));
  }
  return false;
}

void settle_connection(RequestHead& head) {
  std::string connection;
  for (const auto& [name, value] : head.headers) {
    if (equals_ignoring_case(name, "Connection")) connection += "," + value;
  }
  head.keep_alive =
      !lists_token(connection, "close") && (head.version == "HTTP/1.1" || lists_token(connection, "keep-alive"));
  if (head.count("Expect") == 0 || head.version == "HTTP/1.0") return;
  if (head.count("Expect") > 1 || !equals_ignoring_case(head.header("Expect"), "100-continue")) {
    throw crease::Error(code::kExpectationFailed, "the only supported expectation is 100-continue");
  }
  head.expects_continue = head.has_body();
}

}  // namespace

std::size_t RequestHead::count(std::string_view name) const {
  return static_cast<std::size_t>(std::count_if(
      headers.begin(), headers.end(), [&](const auto& header) { return equals_ignoring_case(header.first, name); }));
}

std::string_view RequestHead::header(std::string_view name) const {
  for (const auto& [key, value] : headers) {
    if (equals_ignoring_case(key, name)) return value;
  }
  return {};
}

std::string_view RequestHead::path() const { return std::string_view(target).substr(0, target.find('?')); }

std::string percent_decoded(std::string_view text, bool plus_is_space) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned char byte = 0;
    const char* const digits = text.data() + i + 1;
    if (text[i] == '%' && i + 2 < text.size() && std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2) {
      decoded += static_cast<char>(byte);
      i += 2;
    } else {
      decoded += text[i] == '+' && plus_is_space ? ' ' : text[i];
    }
  }
  return decoded;
}

bool is_path_prefix(std::string_view text) {
  constexpr std::size_t kMaxBytes = 200;
  if (text.empty() || text.size() > kMaxBytes) return false;
  while (!text.empty()) {
    if (!text.starts_with('/')) return false;
    const auto end = std::min(text.find('/', 1), text.size());
    const std::string_view segment = text.substr(1, end - 1);
    const bool plain = std::all_of(segment.begin(), segment.end(), [](unsigned char c) {
      return std::isalnum(c) != 0 || std::string_view("-._~").find(static_cast<char>(c)) != std::string_view::npos;
    });
    if (segment.empty() || segment == "." || segment == ".." || !plain) return false;
    text.remove_prefix(end);
  }
  return true;
}

bool is_field_line(std::string_view line) {
  const auto colon = line.find(':');
  return colon != std::string_view::npos && is_token(line.substr(0, colon)) && is_field_text(line.substr(colon + 1));
}

RequestHead parse_head(std::string_view bytes, const HeadLimits& limits) {
  RequestHead head;
  std::string_view rest = bytes;
  parse_request_line(take_line(rest), limits, head);
  for (std::string_view line = take_line(rest); !line.empty(); line = take_line(rest)) {
    if (head.headers.size() == limits.max_headers) {
      throw crease::Error(code::kHeadersTooLarge, "more than " + std::to_string(limits.max_headers) + " headers");
    }
    parse_field(line, head);
  }
  const std::size_t hosts = head.count("Host");
  if (hosts > 1 || (hosts == 0 && head.version == "HTTP/1.1")) malformed("the request must have one Host header");
  if (!is_authority(head.header("Host"))) malformed("the Host header is not a host");
  refuse_repetition(head);
  settle_framing(head);
  settle_connection(head);
  return head;
}

}  // namespace creased
