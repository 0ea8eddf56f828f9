#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>

#include "core/error.h"
#include "server/http/guarded_stream.h"
#include "server/http/library.h"

namespace creased {

/// One request and its answer, beside what cpp-httplib hands to handlers.
struct Exchange {
  GuardedStream& stream;
  const RequestHead& head;
  std::string request_id;
  std::string route;   ///< template of the path, for metrics
  bool close = false;  ///< the connection ends after this answer
  int status = 0;
};

/// What is known of a request when it is over.
struct ExchangeSummary {
  std::string request_id, method, target, route, remote;
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
  };
  struct Hooks {
    std::function<std::uint64_t(const RequestHead&)> body_limit;  ///< bytes that a request's body may have
    std::function<void(const ExchangeSummary&)> finished;
    /// Body and type of an answer to what was refused before it became a request.
    std::function<std::string(const crease::Error&, const std::string& request_id)> problem;
  };

  GuardedServer(const Options& options, Hooks hooks);

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
  enum class Admission { kAdmitted, kTooMany, kDraining };

  void converse(GuardedStream& stream);
  std::optional<RequestHead> head_or_refusal(GuardedStream& stream);
  bool answer(GuardedStream& stream, const RequestHead& head);
  void refuse(GuardedStream& stream, const crease::Error& error);
  void complete_headers(httplib::Response& response) const;

  Admission admit(int socket);
  /// False: the server drains and the connection must end.
  bool set_active(int socket, bool active);
  void release(int socket);

  Options options_;
  Hooks hooks_;
  std::atomic<bool> draining_{false};
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::unordered_map<int, bool> connections_;  // whether a request is being answered
};

}  // namespace creased
