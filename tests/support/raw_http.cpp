#include "tests/support/raw_http.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <stdexcept>
#include <system_error>

#include "core/base/text.h"

namespace crease::test {
namespace {

using Clock = std::chrono::steady_clock;

RawResponse parse_head(const std::string& head) {
  RawResponse response;
  response.status = std::stoi(head.substr(head.find(' ') + 1));
  std::size_t start = head.find("\r\n") + 2;
  while (start + 2 < head.size()) {
    const auto end = head.find("\r\n", start);
    const std::string line = head.substr(start, end - start);
    const auto colon = line.find(':');
    if (colon == std::string::npos) break;
    const auto value = line.find_first_not_of(' ', colon + 1);
    response.headers.emplace(lower(line.substr(0, colon)), value == std::string::npos ? "" : line.substr(value));
    start = end + 2;
  }
  return response;
}

}  // namespace

std::string RawResponse::header(const std::string& lower_name) const {
  const auto found = headers.find(lower_name);
  return found == headers.end() ? "" : found->second;
}

std::string RawResponse::code() const {
  if (header("content-type") != "application/problem+json") return {};
  return json().value("code", "");
}

RawConnection::RawConnection(int port, const std::string& source)
    : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const auto require_success = [&](int result, const char* what) {
    if (result == 0) return;
    const int reason = errno;
    ::close(socket_);
    throw std::system_error(reason, std::generic_category(), what);
  };
  sockaddr_in address{};
  address.sin_family = AF_INET;
  if (!source.empty()) {
    ::inet_pton(AF_INET, source.c_str(), &address.sin_addr);
    require_success(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), "bind");
  }
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  require_success(::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), "connect");
}

RawConnection::~RawConnection() { close(); }

RawConnection::RawConnection(RawConnection&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)), buffer_(std::move(other.buffer_)) {}

void RawConnection::close() {
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
}

bool RawConnection::send(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

bool RawConnection::fill(Clock::time_point deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
  pollfd entry{socket_, POLLIN, 0};
  if (left.count() <= 0 || ::poll(&entry, 1, static_cast<int>(left.count())) <= 0) return false;
  std::array<char, 65536> piece;
  const ssize_t count = ::recv(socket_, piece.data(), piece.size(), 0);
  if (count <= 0) return false;
  buffer_.append(piece.data(), static_cast<std::size_t>(count));
  return true;
}

std::string RawConnection::receive_until(std::string_view end, std::chrono::milliseconds time) {
  const auto deadline = Clock::now() + time;
  while (buffer_.find(end) == std::string::npos) {
    if (!fill(deadline)) return std::exchange(buffer_, {});
  }
  return take(buffer_.find(end) + end.size());
}

RawResponse RawConnection::receive(std::chrono::milliseconds time, bool has_body) {
  const auto deadline = Clock::now() + time;
  const std::string head = receive_until("\r\n\r\n", time);
  if (!head.ends_with("\r\n\r\n")) return {};
  RawResponse response = parse_head(head);
  if (!has_body || response.status == 204 || response.status == 304 || response.status == 100) return response;
  if (response.header("transfer-encoding") == "chunked") {
    while (true) {
      const std::string line = receive_until("\r\n", time);
      if (!line.ends_with("\r\n")) return response;
      const std::size_t size = std::stoul(line, nullptr, 16);
      while (buffer_.size() < size + 2) {
        if (!fill(deadline)) return response;
      }
      response.body += take(size);
      take(2);
      if (size == 0) return response;
    }
  }
  const std::string length = response.header("content-length");
  while (length.empty() || buffer_.size() < std::stoul(length)) {
    if (!fill(deadline)) break;
  }
  response.body = take(length.empty() ? buffer_.size() : std::min(std::stoul(length), buffer_.size()));
  return response;
}

bool RawConnection::is_closed() {
  const auto deadline = Clock::now() + kPatience;
  while (fill(deadline)) buffer_.clear();
  return Clock::now() < deadline;
}

std::string raw_request(const std::string& method, const std::string& target, const Headers& headers,
                        const std::string& body) {
  std::string text = method + " " + target + " HTTP/1.1\r\nHost: localhost\r\n";
  for (const auto& [name, value] : headers) text.append(name).append(": ").append(value).append("\r\n");
  if (!body.empty() || method == "POST") text += "Content-Length: " + std::to_string(body.size()) + "\r\n";
  return text + "\r\n" + body;
}

namespace {

/// Keeps an answer for the comparison with the OpenAPI document, where the environment names a folder for them.
void keep_answer(const std::string& method, const std::string& target, const RawResponse& response) {
  const char* const folder = std::getenv("CREASED_TEST_ANSWERS");
  if (folder == nullptr || response.status == 0) return;
  nlohmann::json answer = {{"method", method}, {"target", target}, {"status", response.status}};
  for (const auto& header : response.headers) answer["headers"].push_back({header.first, header.second});
  if (response.header("content-type").find("json") != std::string::npos) answer["body"] = response.body;
  static const std::string path = std::string(folder) + "/" + std::to_string(::getpid()) + ".jsonl";
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  std::ofstream(path, std::ios::app) << answer.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) << '\n';
}

}  // namespace

RawResponse exchange(int port, const std::string& method, const std::string& target, const Headers& headers,
                     const std::string& body) {
  RawConnection connection(port);
  connection.send(raw_request(method, target, headers, body));
  RawResponse response = connection.receive(kPatience, method != "HEAD");
  keep_answer(method, target, response);
  return response;
}

RawResponse post_form(int port, const std::string& target, const std::vector<FormPart>& parts, const Headers& headers) {
  const std::string boundary = "----a-boundary-of-the-tests";
  std::string body;
  for (const auto& part : parts) {
    body += "--" + boundary + "\r\nContent-Disposition: form-data; name=\"" + part.name + "\"";
    if (!part.file_name.empty()) body += "; filename=\"" + part.file_name + "\"";
    body += "\r\n";
    if (!part.content_type.empty()) body += "Content-Type: " + part.content_type + "\r\n";
    body += "\r\n" + part.content + "\r\n";
  }
  body += "--" + boundary + "--\r\n";
  Headers all = headers;
  all.emplace_back("Content-Type", "multipart/form-data; boundary=" + boundary);
  return exchange(port, "POST", target, all, body);
}

}  // namespace crease::test
