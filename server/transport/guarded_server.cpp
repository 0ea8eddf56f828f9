#include "server/transport/guarded_server.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <random>
#include <system_error>

#include "core/base/stopwatch.h"
#include "core/base/text.h"

namespace creased {
namespace code = crease::code;
namespace {

using crease::equals_ignoring_case;

constexpr std::size_t kSpareThreads = 16;  // threads that refuse connections over the limit
constexpr int kBacklog = 511;              // cpp-httplib's default is 5
constexpr std::chrono::milliseconds kLinger{3'000};
constexpr std::chrono::milliseconds kShortLinger{200};  // for connections over a limit, so that they free their threads

/// Holds the exchange in the one member of a request that can hold an object of any type. Only clients call it.
struct ExchangeHolder {
  Exchange* exchange;
  bool operator()(const httplib::Response&) const { return true; }
};

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

// Headers that are handled here or in the stream, and so are hidden from the library.
bool is_ours(std::string_view name) {
  return equals_ignoring_case(name, "Content-Length") || equals_ignoring_case(name, "Transfer-Encoding") ||
         equals_ignoring_case(name, "Accept-Encoding") || equals_ignoring_case(name, "Expect") ||
         equals_ignoring_case(name, "Connection") || equals_ignoring_case(name, "Content-Type") ||
         equals_ignoring_case(name, "X-Request-Id");
}

// The library parses this fixed head in place of the client's; fill_request() then sets what the client sent. This
// keeps the library from percent-decoding headers, from acting on ranges, lengths and multipart types, and from
// refusing methods in its own words.
constexpr std::string_view kReplay = "GET / HTTP/1.1\r\n\r\n";

void parse_query(std::string_view query, httplib::Params& params) {
  while (!query.empty()) {
    const auto end = std::min(query.find('&'), query.size());
    const std::string_view pair = query.substr(0, end);
    query.remove_prefix(std::min(end + 1, query.size()));
    const auto equals = std::min(pair.find('='), pair.size());
    const std::string name(pair.substr(0, equals)), value(pair.substr(std::min(equals + 1, pair.size())));
    if (!pair.empty()) {
      params.emplace(percent_decoded(name, true), percent_decoded(value, true));
    }
  }
}

/// The values of all headers with this name, joined by commas.
std::string joined_header(const RequestHead& head, std::string_view name) {
  std::string list;
  for (const auto& [key, value] : head.headers) {
    if (equals_ignoring_case(key, name)) list += (list.empty() ? "" : ",") + value;
  }
  return list;
}

Address peer_of(const GuardedStream& stream) {
  std::string text;
  int port = 0;
  stream.get_remote_ip_and_port(text, port);
  return Address::parse(text).value_or(Address());
}

/// Headers of every answer. They keep browsers from guessing types and from running or embedding the content.
constexpr std::array<std::pair<const char*, const char*>, 5> kSecurityHeaders = {
    {{"X-Content-Type-Options", "nosniff"},
     {"Content-Security-Policy", "default-src 'none'; frame-ancestors 'none'"},
     {"Referrer-Policy", "no-referrer"},
     {"Cross-Origin-Resource-Policy", "same-origin"},
     {"Server", "creased"}}};

void fill_request(Exchange& exchange, httplib::Request& request) {
  request.response_handler = ExchangeHolder{&exchange};
  const RequestHead& head = exchange.head;
  request.method = head.method;
  request.target = head.target;
  request.version = head.version;
  request.path = exchange.path;
  request.params = query_of(head);
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

httplib::Params query_of(const RequestHead& head) {
  httplib::Params params;
  parse_query(std::string_view(head.target).substr(std::min(head.path().size() + 1, head.target.size())), params);
  return params;
}

Exchange& exchange_of(const httplib::Request& request) {
  return *request.response_handler.target<ExchangeHolder>()->exchange;
}

GuardedServer::GuardedServer(Options options, Hooks hooks)
    : options_(std::move(options)),
      hooks_(std::move(hooks)),
      shares_(options_.max_connections, options_.max_connections_per_address) {
  new_task_queue = [this] {
    if (threads_ == nullptr) take_threads();
    return threads_.release();
  };
  set_post_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
    complete_headers(exchange_of(request), response);
  });
}

void GuardedServer::take_threads() {
  threads_ = std::make_unique<ThreadPool>(options_.max_connections + kSpareThreads);
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

std::size_t GuardedServer::connections() const {
  const std::lock_guard lock(mutex_);
  return connections_.size();
}

bool GuardedServer::process_and_close_socket(int socket) {
  const int yes = 1;
  ::fcntl(socket, F_SETFD, FD_CLOEXEC);
  ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  GuardedStream stream(socket, options_.stream);
  try {
    admit(socket, peer_of(stream));
    try {
      converse(stream);
    } catch (const std::exception& error) {
      spdlog::error("connection closed after an error: {}", error.what());
    }
    release(socket);
  } catch (const crease::Error& error) {
    refuse(stream, error, kShortLinger);
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
    refuse(stream, error, kLinger);
    return std::nullopt;
  }
}

bool GuardedServer::answer(GuardedStream& stream, const RequestHead& head) {
  const crease::Stopwatch stopwatch;
  Exchange exchange{stream,
                    head,
                    request_id_of(head),
                    path_of(head),
                    source_of(stream, head),
                    options_.base_path,
                    !head.keep_alive || draining_};
  try {
    exchange.base = base_of(stream, head);
  } catch (const crease::Error& error) {
    exchange.refusal = error;
  }
  stream.begin(head, std::string(kReplay), hooks_.begin(exchange));
  bool closed = false;
  const bool written = process_request(stream, exchange.close, closed,
                                       [&](httplib::Request& request) { fill_request(exchange, request); });

  hooks_.finished({exchange.request_id, head.method, head.target, exchange.route, exchange.source.address.text(),
                   exchange.caller.owner(), exchange.code, exchange.status, stream.body_bytes(), stream.bytes_written(),
                   stopwatch.seconds()});
  if (!stream.body_complete()) stream.linger(kLinger);
  return written && !exchange.close && stream.body_complete();
}

Source GuardedServer::source_of(const GuardedStream& stream, const RequestHead& head) const {
  const Address peer = peer_of(stream);
  const bool given = head.count("X-Forwarded-For") > 0;
  const auto forwarded_for = given ? std::optional(joined_header(head, "X-Forwarded-For")) : std::nullopt;
  const Origin client = client_of(peer, forwarded_for.value_or(""), options_.trusted_proxies);
  return {client.address, is_local(peer, forwarded_for, head.count("Forwarded") > 0, options_.trusted_proxies)};
}

std::string GuardedServer::base_of(const GuardedStream& stream, const RequestHead& head) const {
  std::string_view prefix = head.header("X-Forwarded-Prefix");
  if (prefix.empty() || !options_.trusted_proxies.contains(peer_of(stream))) return options_.base_path;
  if (prefix.ends_with('/')) prefix.remove_suffix(1);
  if (!prefix.empty() && !is_path_prefix(prefix)) {
    throw crease::Error(code::kRequestMalformed, "the header X-Forwarded-Prefix is not a path like /meshes");
  }
  return std::string(prefix);
}

std::string GuardedServer::path_of(const RequestHead& head) const {
  std::string path = percent_decoded(head.path(), false);
  const std::string& base = options_.base_path;
  const bool below = path.starts_with(base) && (path.size() == base.size() || path[base.size()] == '/');
  return below ? path.substr(base.size()) : path;
}

void GuardedServer::refuse(GuardedStream& stream, const crease::Error& error, std::chrono::milliseconds linger) {
  const std::string id = new_request_id();
  const Refusal refusal = hooks_.refusal(error, id);
  std::string head = fmt::format(
      "HTTP/1.1 {} {}\r\nContent-Type: application/problem+json\r\nContent-Length: {}\r\nConnection: close\r\n"
      "Cache-Control: no-store\r\nX-Request-Id: {}\r\n",
      refusal.status, refusal.reason, refusal.body.size(), id);
  for (const auto& [name, value] : kSecurityHeaders) head += fmt::format("{}: {}\r\n", name, value);
  if (refusal.retry_after_s > 0) head += fmt::format("Retry-After: {}\r\n", refusal.retry_after_s);
  stream.write(head + "\r\n" + refusal.body);
  hooks_.finished(
      {id, "", "", "", peer_of(stream).text(), "", error.code(), refusal.status, 0, stream.bytes_written(), 0});
  stream.linger(linger);
}

void GuardedServer::complete_headers(Exchange& exchange, httplib::Response& response) const {
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
  for (const auto& [name, value] : kSecurityHeaders) {
    if (!response.has_header(name)) headers.emplace(name, value);
  }
  headers.emplace("X-Request-Id", exchange.request_id);
  hooks_.complete(exchange, response);
}

void GuardedServer::admit(int socket, const Address& peer) {
  const std::lock_guard lock(mutex_);
  if (draining_) throw crease::Error(code::kShuttingDown, "the server is shutting down");
  if (shares_.is_full()) {
    throw crease::Error(code::kTooManyConnections, "the server has no free connection; try again in a moment");
  }
  if (!shares_.has_place(peer, !options_.trusted_proxies.contains(peer))) {
    throw crease::Error(
        code::kAddressConnectionsFull,
        fmt::format("{} connections from your address are open, the most that are allowed now", shares_.count(peer)));
  }
  shares_.add(peer);
  connections_[socket] = {peer, false};
}

bool GuardedServer::set_active(int socket, bool active) {
  const std::lock_guard lock(mutex_);
  connections_[socket].active = active;
  if (!active) changed_.notify_all();
  return active || !draining_;
}

void GuardedServer::release(int socket) {
  const std::lock_guard lock(mutex_);
  const auto connection = connections_.find(socket);
  shares_.remove(connection->second.address);
  connections_.erase(connection);
  changed_.notify_all();
}

void GuardedServer::drain(std::chrono::milliseconds grace) {
  const auto none_active = [this] {
    return std::none_of(connections_.begin(), connections_.end(),
                        [](const auto& entry) { return entry.second.active; });
  };
  std::unique_lock lock(mutex_);
  draining_ = true;
  for (const auto& [socket, connection] : connections_) {
    if (!connection.active) ::shutdown(socket, SHUT_RD);
  }
  changed_.wait_for(lock, grace, none_active);
  lock.unlock();
  stop();
  lock.lock();
  for (const auto& [socket, connection] : connections_) ::shutdown(socket, SHUT_RDWR);
}

}  // namespace creased
