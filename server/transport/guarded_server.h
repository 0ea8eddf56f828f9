#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>

#include "core/error.h"
#include "server/access/gatekeeper.h"
#include "server/transport/connection_shares.h"
#include "server/transport/guarded_stream.h"
#include "server/transport/library.h"
#include "server/transport/thread_pool.h"

namespace creased {

/// One request and its answer: what cpp-httplib does not pass to handlers.
struct Exchange {
  GuardedStream& stream;
  const RequestHead& head;
  std::string request_id;
  std::string path;  ///< percent-decoded, without the base path; empty for the base path without a slash
  Source source;
  std::string base;        ///< what the client has before each path, such as "/meshes"; empty for nothing
  bool close = false;      ///< the connection ends after this answer
  std::string route = {};  ///< path template, for the metrics
  std::optional<crease::ErrorCode> code = {};  ///< of the error that was answered
  Caller caller = {};
  bool linked = false;                        ///< allowed by the signature in its query, in place of a key
  std::optional<crease::Error> refusal = {};  ///< set when the request is refused by its head alone
  std::chrono::seconds retry_after{0};        ///< 0: as for any refusal with this status
  int status = 0;
};

/// The fields of a request's query, percent-decoded.
httplib::Params query_of(const RequestHead& head);

/// The exchange that a request of the library belongs to.
Exchange& exchange_of(const httplib::Request& request);

/// The answer to a connection or request that is refused before it reaches the library.
struct Refusal {
  int status;
  std::string reason;  ///< of the status line
  std::string body;    ///< a problem document
  int retry_after_s;   ///< 0 for none
};

/// What is known of a request when it has ended.
struct ExchangeSummary {
  std::string request_id, method, target, route, remote, key;
  std::optional<crease::ErrorCode> code = {};
  int status = 0;  ///< 0 when the client disconnected before the answer
  std::uint64_t bytes_in = 0, bytes_out = 0;
  double seconds = 0;
};

/// cpp-httplib's server with our own handling of connections. It parses heads strictly, sets deadlines, limits bodies
/// and the number of connections, ends keep-alive when the server drains, and never reads the rest of a body as a
/// request.
class GuardedServer : public httplib::Server {
 public:
  struct Options {
    StreamLimits stream;
    std::size_t max_connections = 1'500;
    std::size_t max_connections_per_address = 0;  ///< 0 for no limit
    AddressList trusted_proxies;                  ///< peers whose X-Forwarded-For and X-Forwarded-Prefix are trusted
    std::string base_path;                        ///< before the paths of requests, which may also come without it
  };
  struct Hooks {
    /// Identifies the caller and decides from the head whether to refuse the request. Returns the largest body allowed,
    /// in bytes.
    std::function<std::uint64_t(Exchange&)> begin;
    /// Adds headers to an answer just before it is sent.
    std::function<void(const Exchange&, httplib::Response&)> complete;
    std::function<void(const ExchangeSummary&)> finished;
    std::function<Refusal(const crease::Error&, const std::string& request_id)> refusal;
  };

  GuardedServer(Options options, Hooks hooks);

  /// Takes the threads for all connections, before bind(). \throw crease::Error process_unavailable
  void take_threads();

  /// Binds to the port, or to a free one for 0, and returns it. It does not set SO_REUSEPORT, so a port in use is an
  /// error.
  /// \throw std::system_error
  int bind(const std::string& host, int port);

  /// Serves until drain() or stop() is called. Blocks.
  bool serve() { return listen_after_bind(); }

  /// Closes idle connections, gives running requests `grace` to finish, then closes the rest and stops the server.
  void drain(std::chrono::milliseconds grace);

  bool draining() const { return draining_; }
  std::size_t connections() const;

  /// Answers all requests of one connection.
  bool process_and_close_socket(int socket) override;

 private:
  struct Connection {
    Address address;
    bool active = false;  ///< a request is being answered
  };

  void converse(GuardedStream& stream);
  Source source_of(const GuardedStream& stream, const RequestHead& head) const;
  /// \throw crease::Error request_malformed
  std::string base_of(const GuardedStream& stream, const RequestHead& head) const;
  std::string path_of(const RequestHead& head) const;
  std::optional<RequestHead> head_or_refusal(GuardedStream& stream);
  bool answer(GuardedStream& stream, const RequestHead& head);
  void refuse(GuardedStream& stream, const crease::Error& error, std::chrono::milliseconds linger);
  void complete_headers(Exchange& exchange, httplib::Response& response) const;

  /// \throw crease::Error shutting_down, too_many_connections, address_connections_full
  void admit(int socket, const Address& peer);
  /// Returns false when the server is draining and the connection must close.
  bool set_active(int socket, bool active);
  void release(int socket);

  Options options_;
  Hooks hooks_;
  std::unique_ptr<ThreadPool> threads_;  // until the library takes them over
  std::atomic<bool> draining_{false};
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::unordered_map<int, Connection> connections_;
  ConnectionShares shares_;
};

}  // namespace creased
