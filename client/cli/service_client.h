#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "client/cli/event_parser.h"
#include "client/cli/interruption.h"
#include "crease/v1/job.pb.h"

namespace crease::client {

using Query = std::multimap<std::string, std::string>;

/// A service and the key for it.
struct Server {
  std::string url;                 ///< http://host:port or https://host, with any path before those of the service
  std::string key;                 ///< empty: use the key file
  std::filesystem::path key_file;  ///< empty for none
};

/// Calls the service, one call at a time. Every call throws Failure with the service's problem document,
/// server_unreachable, or interrupted; an interruption ends a call at once.
class ServiceClient {
 public:
  using Json = nlohmann::ordered_json;

  ServiceClient(const Server& server, Interruption& interruption);
  ~ServiceClient();
  ServiceClient(const ServiceClient&) = delete;
  ServiceClient& operator=(const ServiceClient&) = delete;

  /// Uploads the mesh, with a file of weights unless `weights` is empty, and returns the job. The service guesses an
  /// empty `format`.
  Json submit(const std::filesystem::path& mesh, const std::string& format, const std::filesystem::path& weights,
              const v1::Parameters& parameters);
  Json get(const std::string& path, const Query& query = {});
  Json post(const std::string& path);
  void remove(const std::string& path);
  /// Downloads into a file, which appears complete or not at all. Returns the number of bytes.
  std::uint64_t download(const std::string& path, const Query& query, const std::filesystem::path& file);
  std::string download(const std::string& path, const Query& query);

  /// Follows a job to its end and returns it. Reconnects when the connection is lost.
  Json follow(const std::string& id, const std::function<void(const v1::Progress&)>& on_progress);

 private:
  class Connection;
  using OnProgress = std::function<void(const v1::Progress&)>;

  /// One connection of follow(). Returns true when `job` has ended.
  bool listen(const std::string& id, std::string& last_event_id, Json& job, const OnProgress& on_progress);

  Interruption& interruption_;
  std::unique_ptr<Connection> connection_;
};

/// \throw Failure server_unreachable when the JSON does not match the message
template <typename Message>
Message from_json(const nlohmann::ordered_json& json);

}  // namespace crease::client
