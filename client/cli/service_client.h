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

/// A service, and what opens it.
struct Server {
  std::string url;                 ///< http://host:port or https://host
  std::string key;                 ///< empty: that of the file
  std::filesystem::path key_file;  ///< empty: none
};

/// The calls of the service, one at a time. Every one throws Failure: the service's problem document,
/// server_unreachable, or interrupted, which ends a call that is under way.
class ServiceClient {
 public:
  using Json = nlohmann::ordered_json;

  ServiceClient(const Server& server, Interruption& interruption);
  ~ServiceClient();
  ServiceClient(const ServiceClient&) = delete;
  ServiceClient& operator=(const ServiceClient&) = delete;

  /// Streams the mesh up, with a file of weights unless that is empty. `format` may be empty: then the service guesses.
  /// Returns the job.
  Json submit(const std::filesystem::path& mesh, const std::string& format, const std::filesystem::path& weights,
              const v1::Parameters& parameters);
  Json get(const std::string& path, const Query& query = {});
  Json post(const std::string& path);
  void remove(const std::string& path);
  /// Into a file, which appears whole or not at all. Returns its bytes.
  std::uint64_t download(const std::string& path, const Query& query, const std::filesystem::path& file);
  std::string download(const std::string& path, const Query& query);

  /// Follows a job until it has ended, over lost connections too, and returns it.
  Json follow(const std::string& id, const std::function<void(const v1::Progress&)>& on_progress);

 private:
  class Connection;
  using OnProgress = std::function<void(const v1::Progress&)>;

  /// One connection of follow(): true when `job` has ended.
  bool listen(const std::string& id, std::string& last_event_id, Json& job, const OnProgress& on_progress);

  Interruption& interruption_;
  std::unique_ptr<Connection> connection_;
};

/// \throw Failure server_unreachable when that is not the JSON of the message
template <typename Message>
Message from_json(const nlohmann::ordered_json& json);

}  // namespace crease::client
