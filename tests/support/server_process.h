#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/patience.h"
#include "tests/support/program.h"
#include "tests/support/raw_http.h"
#include "tests/support/temporary_folder.h"

namespace crease::test {

/// `creased serve` on a free port of loopback, with a temporary data folder unless `flags` name one. The destructor
/// ends it and its workers.
class ServerProcess {
 public:
  explicit ServerProcess(const std::vector<std::string>& flags = {});
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  int port() const { return port_; }
  int pid() const { return program_->pid(); }
  const std::filesystem::path& data_dir() const { return data_dir_; }
  /// The log so far.
  std::string log() const { return program_->errors(); }

  void signal(int number) const { program_->signal(number); }
  /// Waits for the end. Returns the exit code, negative for a signal, or Program::kStillRuns when it does not end.
  int wait() { return program_->wait(); }

  RawResponse get(const std::string& target, const Headers& headers = {}) const;
  /// Submits an OBJ as raw body and returns the job.
  nlohmann::json submit(const std::string& obj, const std::string& query, const Headers& headers = {}) const;
  /// Follows the event stream until the job has ended, and returns the job.
  nlohmann::json wait_for_end(const std::string& id) const;
  /// Waits until the job is in this state or has ended, and returns the job.
  nlohmann::json wait_for_state(const std::string& id, const std::string& state, const Headers& headers = {}) const;

 private:
  TemporaryFolder folder_;
  std::filesystem::path data_dir_;
  std::optional<Program> program_;
  int port_ = 0;
};

/// One event of a stream of server-sent events.
struct ServerEvent {
  std::string id, type, data;
};
std::vector<ServerEvent> parse_events(const std::string& stream);

}  // namespace crease::test
