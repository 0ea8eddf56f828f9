#pragma once

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace crease::test {

/// An answer as it came over the wire.
struct RawResponse {
  int status = 0;                                   ///< 0: none came
  std::multimap<std::string, std::string> headers;  ///< names in lower case
  std::string body;

  std::string header(const std::string& lower_name) const;
  nlohmann::json json() const { return nlohmann::json::parse(body); }
  /// `code` of a problem document; empty for anything else.
  std::string code() const;
};

/// A TCP connection to a server on loopback, for requests that no well-behaved client would send.
class RawConnection {
 public:
  /// From `source`, an address of 127.0.0.0/8, unless that is empty.
  explicit RawConnection(int port, const std::string& source = {});
  ~RawConnection();
  RawConnection(const RawConnection&) = delete;
  RawConnection& operator=(const RawConnection&) = delete;
  RawConnection(RawConnection&& other) noexcept;

  /// False once the server has closed its end.
  bool send(std::string_view bytes);
  /// The next answer; chunks decoded. `has_body` false after HEAD.
  RawResponse receive(std::chrono::milliseconds time = std::chrono::seconds(20), bool has_body = true);
  /// Everything up to the first `end`, inclusive; less when the connection ends or the time is up.
  std::string receive_until(std::string_view end, std::chrono::milliseconds time = std::chrono::seconds(20));
  /// Whether the server ends the connection within the time; what it sends before is dropped.
  bool closed_within(std::chrono::milliseconds time);
  void close();

 private:
  bool fill(std::chrono::steady_clock::time_point deadline);
  std::string take(std::size_t count) { return std::exchange(buffer_, buffer_.substr(count)).substr(0, count); }

  int socket_ = -1;
  std::string buffer_;
};

using Headers = std::vector<std::pair<std::string, std::string>>;

/// A request line with headers, Host and Content-Length added.
std::string raw_request(const std::string& method, const std::string& target, const Headers& headers = {},
                        const std::string& body = {});

/// One request on a connection of its own.
RawResponse exchange(int port, const std::string& method, const std::string& target, const Headers& headers = {},
                     const std::string& body = {});

struct FormPart {
  std::string name, content, file_name, content_type;
};
/// POST of multipart/form-data.
RawResponse post_form(int port, const std::string& target, const std::vector<FormPart>& parts,
                      const Headers& headers = {});

}  // namespace crease::test
