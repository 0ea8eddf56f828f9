#pragma once

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/patience.h"

namespace crease::test {

/// An answer as received.
struct RawResponse {
  int status = 0;                                   ///< 0 when there was no answer
  std::multimap<std::string, std::string> headers;  ///< names in lower case
  std::string body;

  std::string header(const std::string& lower_name) const;
  nlohmann::json json() const { return nlohmann::json::parse(body); }
  /// The `code` of a problem document; empty for any other body.
  std::string code() const;
};

/// A TCP connection to a server on loopback, for requests that no well-behaved client would send.
class RawConnection {
 public:
  /// Connects, from the address `source` in 127.0.0.0/8 unless it is empty.
  explicit RawConnection(int port, const std::string& source = {});
  ~RawConnection();
  RawConnection(const RawConnection&) = delete;
  RawConnection& operator=(const RawConnection&) = delete;
  RawConnection(RawConnection&& other) noexcept;

  /// Returns false when the server has closed its end.
  bool send(std::string_view bytes);
  /// Reads the next answer and decodes its chunks. `has_body` is false after a HEAD request.
  RawResponse receive(std::chrono::milliseconds time = kPatience, bool has_body = true);
  /// Reads up to and including the first `end`; less when the connection closes or the time is over.
  std::string receive_until(std::string_view end, std::chrono::milliseconds time = kPatience);
  /// Whether the server closes the connection. Discards what it sends before.
  bool is_closed();
  void close();

 private:
  bool fill(std::chrono::steady_clock::time_point deadline);
  std::string take(std::size_t count) { return std::exchange(buffer_, buffer_.substr(count)).substr(0, count); }

  int socket_ = -1;
  std::string buffer_;
};

using Headers = std::vector<std::pair<std::string, std::string>>;

/// A request with the headers, Host and Content-Length.
std::string raw_request(const std::string& method, const std::string& target, const Headers& headers = {},
                        const std::string& body = {});

/// Makes a request on a new connection.
RawResponse exchange(int port, const std::string& method, const std::string& target, const Headers& headers = {},
                     const std::string& body = {});

struct FormPart {
  std::string name, content, file_name, content_type;
};
/// POST of multipart/form-data.
RawResponse post_form(int port, const std::string& target, const std::vector<FormPart>& parts,
                      const Headers& headers = {});

}  // namespace crease::test
