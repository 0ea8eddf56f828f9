#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>

#include "core/error.h"
#include "server/access/gatekeeper.h"
#include "server/http/guarded_stream.h"
#include "server/http/library.h"

namespace creased {

/// One request and its answer, beside what cpp-httplib hands to handlers.
struct Exchange {
  GuardedStream& stream;
  const RequestHead& head;
  std::string request_id;
  std::string path;  ///< percent-decoded
  Source source;
  bool close = false;      ///< the connection ends after this answer
  std::string route = {};  ///< template of the path, for metrics
  Caller caller = {};
  std::optional<crease::Error> refusal = {};  ///< why the request gets no further than its head
  std::chrono::seconds retry_after{0};        ///< 0: as its refusal has it
  int status = 0;
};

/// What is known of a request when it is over.
struct ExchangeSummary {
  std::string request_id, method, target, route, remote, key;
  int status = 0;  ///< 0: the client left before an answer
  std::uint64_t bytes_in = 0, bytes_out = 0;
  double seconds = 0;
};

/// cpp-httplib's server with connections of our own: strict heads, deadlines, counted bodies, a bound on connections,
/// a keep-alive loop that ends when the server drains, and no rest of a body that could run as a request.
class GuardedServer : public httplib::Server {
 public:
  struct Options {
    StreamLimits stream;
    std::size_t max_connections = 1'500;
    std::size_t max_connections_per_address = 0;  ///< 0: no bound
    AddressList trusted_proxies;                  ///< whose X-Forwarded-For is believed
  };
  struct Hooks {
    /// Settles caller and refusal of a request by its head. Returns the bytes that its body may have.
    std::function<std::uint64_t(Exchange&)> begin;
    /// Adds headers to an answer that is about to be sent.
    std::function<void(const Exchange&, httplib::Response&)> complete;
    std::function<void(const ExchangeSummary&)> finished;
    /// Body and type of an answer to what was refused before it became a request.
    std::function<std::string(const crease::Error&, const std::string& request_id)> problem;
  };

  GuardedServer(Options options, Hooks hooks);

  /// Binds without SO_REUSEPORT, so that a port in use is an error, and returns the port (for 0: the one that was
  /// free). \throw std::system_error
  int bind(const std::string& host, int port);

  /// Answers until drain() or stop(). Blocks.
  bool serve() { return listen_after_bind(); }

  /// Ends idle connections, gives requests under way `grace` to finish, then ends the rest and the server.
  void drain(std::chrono::milliseconds grace);

  bool draining() const { return draining_; }
  std::size_t connections() const;

  /// The exchange that the calling thread answers.
  static Exchange& exchange();

  /// Answers the requests of one connection to its end.
  bool process_and_close_socket(int socket) override;

 private:
  struct Connection {
    std::string address;  ///< as bounds on addresses count it
    bool active = false;  ///< a request is being answered
  };

  void converse(GuardedStream& stream);
  Source source_of(const GuardedStream& stream, const RequestHead& head) const;
  std::optional<RequestHead> head_or_refusal(GuardedStream& stream);
  bool answer(GuardedStream& stream, const RequestHead& head);
  void refuse(GuardedStream& stream, const crease::Error& error, std::chrono::milliseconds linger);
  void complete_headers(httplib::Response& response) const;

  /// \throw crease::Error shutting_down, too_many_connections, address_connections_full
  void admit(int socket, const Address& peer);
  /// False: the server drains and the connection must end.
  bool set_active(int socket, bool active);
  void release(int socket);

  Options options_;
  Hooks hooks_;
  std::atomic<bool> draining_{false};
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::unordered_map<int, Connection> connections_;
  std::unordered_map<std::string, std::size_t> of_address_;  // connections
};

}  // namespace creased
