#include "server/http/guarded_server.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <random>
#include <system_error>

#include "proto/error_table.h"

namespace creased {
namespace {

constexpr std::size_t kSpareThreads = 16;  // to refuse connections over the bound
constexpr int kBacklog = 511;              // cpp-httplib's own is 5

thread_local Exchange* current_exchange = nullptr;

std::string new_request_id() {
  thread_local std::mt19937_64 engine{std::random_device{}()};
  return fmt::format("{:016x}", engine());
}

std::string request_id_of(const RequestHead& head) {
  const std::string_view given = head.header("X-Request-Id");
  const auto sane = [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.'; };
  const bool usable = !given.empty() && given.size() <= 64 && std::all_of(given.begin(), given.end(), sane);
  return usable ? std::string(given) : new_request_id();
}

// Headers that the stream or we act on, in place of the library.
bool is_ours(std::string_view name) {
  return equals_ignoring_case(name, "Content-Length") || equals_ignoring_case(name, "Transfer-Encoding") ||
         equals_ignoring_case(name, "Accept-Encoding") || equals_ignoring_case(name, "Expect") ||
         equals_ignoring_case(name, "Connection") || equals_ignoring_case(name, "Content-Type") ||
         equals_ignoring_case(name, "X-Request-Id");
}

// All that the library parses itself; what the client sent is set on its request afterwards, so that it neither
// percent-decodes headers, nor acts on ranges, lengths and multipart types, nor refuses methods in its own words.
constexpr std::string_view kReplay = "GET / HTTP/1.1\r\n\r\n";

void parse_query(std::string_view query, httplib::Params& params) {
  while (!query.empty()) {
    const auto end = std::min(query.find('&'), query.size());
    const std::string_view pair = query.substr(0, end);
    query.remove_prefix(std::min(end + 1, query.size()));
    const auto equals = std::min(pair.find('='), pair.size());
    const std::string name(pair.substr(0, equals)), value(pair.substr(std::min(equals + 1, pair.size())));
    if (!pair.empty()) {
      params.emplace(httplib::detail::decode_url(name, true), httplib::detail::decode_url(value, true));
    }
  }
}

void fill_request(const Exchange& exchange, httplib::Request& request) {
  const RequestHead& head = exchange.head;
  const std::string_view path = head.path();
  request.method = head.method;
  request.target = head.target;
  request.version = head.version;
  request.path = httplib::detail::decode_url(std::string(path), false);
  parse_query(std::string_view(head.target).substr(std::min(path.size() + 1, head.target.size())), request.params);
  request.headers.clear();
  for (const auto& [name, value] : head.headers) {
    if (!is_ours(name)) request.headers.emplace(name, value);
  }
  if (head.expects_continue) request.headers.emplace("Expect", "100-continue");
}

int listening_socket(const addrinfo& address) {
  const int socket = ::socket(address.ai_family, address.ai_socktype | SOCK_CLOEXEC, address.ai_protocol);
  if (socket < 0) return -1;
  const int yes = 1;
  ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (::bind(socket, address.ai_addr, address.ai_addrlen) == 0 && ::listen(socket, kBacklog) == 0) return socket;
  const int reason = errno;
  ::close(socket);
  errno = reason;
  return -1;
}

int port_of(int socket) {
  sockaddr_storage storage{};
  socklen_t size = sizeof storage;
  ::getsockname(socket, reinterpret_cast<sockaddr*>(&storage), &size);
  return storage.ss_family == AF_INET6 ? ntohs(reinterpret_cast<sockaddr_in6*>(&storage)->sin6_port)
                                       : ntohs(reinterpret_cast<sockaddr_in*>(&storage)->sin_port);
}

}  // namespace

GuardedServer::GuardedServer(const Options& options, Hooks hooks) : options_(options), hooks_(std::move(hooks)) {
  new_task_queue = [threads = options_.max_connections + kSpareThreads] { return new httplib::ThreadPool(threads); };
  set_post_routing_handler(
      [this](const httplib::Request&, httplib::Response& response) { complete_headers(response); });
}

int GuardedServer::bind(const std::string& host, int port) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found); error != 0) {
    throw std::system_error(std::make_error_code(std::errc::address_not_available), ::gai_strerror(error));
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> addresses(found, &::freeaddrinfo);
  int reason = EADDRNOTAVAIL;
  for (const addrinfo* address = found; address != nullptr; address = address->ai_next) {
    const int socket = listening_socket(*address);
    if (socket >= 0) {
      svr_sock_ = socket;
      return port_of(socket);
    }
    reason = errno;
  }
  throw std::system_error(reason, std::generic_category());
}

Exchange& GuardedServer::exchange() { return *current_exchange; }

std::size_t GuardedServer::connections() const {
  const std::lock_guard lock(mutex_);
  return connections_.size();
}

bool GuardedServer::process_and_close_socket(int socket) {
  const int yes = 1;
  ::fcntl(socket, F_SETFD, FD_CLOEXEC);
  ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  GuardedStream stream(socket, options_.stream);
  switch (admit(socket)) {
    case Admission::kAdmitted:
      try {
        converse(stream);
      } catch (const std::exception& error) {
        spdlog::error("a connection ended by an error: {}", error.what());
      }
      release(socket);
      break;
    case Admission::kTooMany:
      refuse(stream, crease::Error("too_many_connections", "all connections are taken; try again in a moment"));
      break;
    case Admission::kDraining:
      refuse(stream, crease::Error("shutting_down", "the server is going down"));
      break;
  }
  ::shutdown(socket, SHUT_RDWR);
  ::close(socket);
  return true;
}

void GuardedServer::converse(GuardedStream& stream) {
  while (stream.await_request()) {
    if (!set_active(stream.socket(), true)) return;
    const auto head = head_or_refusal(stream);
    if (!head || !answer(stream, *head)) return;
    if (!set_active(stream.socket(), false)) return;
  }
}

std::optional<RequestHead> GuardedServer::head_or_refusal(GuardedStream& stream) {
  try {
    return stream.read_head();
  } catch (const crease::Error& error) {
    refuse(stream, error);
    return std::nullopt;
  }
}

bool GuardedServer::answer(GuardedStream& stream, const RequestHead& head) {
  const auto start = GuardedStream::Clock::now();
  Exchange exchange{stream, head, request_id_of(head), "", !head.keep_alive || draining_, 0};
  stream.begin(head, std::string(kReplay), hooks_.body_limit(head));
  current_exchange = &exchange;
  bool closed = false;
  const bool written = process_request(stream, exchange.close, closed,
                                       [&](httplib::Request& request) { fill_request(exchange, request); });
  current_exchange = nullptr;

  std::string remote;
  int port = 0;
  stream.get_remote_ip_and_port(remote, port);
  const std::chrono::duration<double> time = GuardedStream::Clock::now() - start;
  hooks_.finished({exchange.request_id, head.method, head.target, exchange.route, remote, exchange.status,
                   stream.body_bytes(), stream.bytes_written(), time.count()});
  if (!stream.body_complete()) stream.linger();
  return written && !exchange.close && stream.body_complete();
}

void GuardedServer::refuse(GuardedStream& stream, const crease::Error& error) {
  const auto& kind = crease::error_kind(error.code());
  const std::string id = new_request_id();
  const std::string body = hooks_.problem(error, id);
  stream.write(
      fmt::format("HTTP/1.1 {} {}\r\nContent-Type: application/problem+json\r\nContent-Length: {}\r\n"
                  "Connection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n"
                  "X-Request-Id: {}\r\nServer: creased\r\n{}\r\n{}",
                  kind.status, kind.title, body.size(), id, kind.status == 503 ? "Retry-After: 1\r\n" : "", body));
  std::string remote;
  int port = 0;
  stream.get_remote_ip_and_port(remote, port);
  hooks_.finished({id, "", "", "", remote, kind.status, 0, stream.bytes_written(), 0});
  stream.linger();
}

void GuardedServer::complete_headers(httplib::Response& response) const {
  Exchange& exchange = *current_exchange;
  exchange.status = response.status;
  exchange.close = exchange.close || draining_ || !exchange.stream.body_complete();
  auto& headers = response.headers;
  headers.erase("Keep-Alive");
  headers.erase("Connection");
  if (exchange.close) {
    headers.emplace("Connection", "close");
  } else if (exchange.head.version == "HTTP/1.0") {
    headers.emplace("Connection", "keep-alive");
  }
  if (response.status == 204 || response.status == 304) headers.erase("Content-Length");
  if (!response.content_provider_ && response.status != 416) headers.erase("Accept-Ranges");
  if (!response.has_header("Cache-Control")) headers.emplace("Cache-Control", "no-store");
  headers.emplace("X-Content-Type-Options", "nosniff");
  headers.emplace("X-Request-Id", exchange.request_id);
  headers.emplace("Server", "creased");
}

GuardedServer::Admission GuardedServer::admit(int socket) {
  const std::lock_guard lock(mutex_);
  if (draining_) return Admission::kDraining;
  if (connections_.size() >= options_.max_connections) return Admission::kTooMany;
  connections_[socket] = false;
  return Admission::kAdmitted;
}

bool GuardedServer::set_active(int socket, bool active) {
  const std::lock_guard lock(mutex_);
  connections_[socket] = active;
  if (!active) changed_.notify_all();
  return active || !draining_;
}

void GuardedServer::release(int socket) {
  const std::lock_guard lock(mutex_);
  connections_.erase(socket);
  changed_.notify_all();
}

void GuardedServer::drain(std::chrono::milliseconds grace) {
  const auto none_active = [this] {
    return std::none_of(connections_.begin(), connections_.end(), [](const auto& entry) { return entry.second; });
  };
  std::unique_lock lock(mutex_);
  draining_ = true;
  for (const auto& [socket, active] : connections_) {
    if (!active) ::shutdown(socket, SHUT_RD);
  }
  changed_.wait_for(lock, grace, none_active);
  lock.unlock();
  stop();
  lock.lock();
  for (const auto& [socket, active] : connections_) ::shutdown(socket, SHUT_RDWR);
}

}  // namespace creased
