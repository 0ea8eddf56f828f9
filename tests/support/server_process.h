#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/raw_http.h"

namespace crease::test {

/// A temporary folder. The destructor removes it.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// The outcome of a program.
struct Finished {
  int exit_code = -1;  ///< negative for the number of a signal
  std::string output;  ///< standard output
  std::string errors;  ///< standard error
};
Finished run_program(const std::vector<std::string>& command);

/// `creased serve` on a free port of loopback, with a temporary data folder unless `flags` name one. The destructor
/// ends it and its workers.
class ServerProcess {
 public:
  explicit ServerProcess(const std::vector<std::string>& flags = {});
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  int port() const { return port_; }
  int pid() const { return pid_; }
  const std::filesystem::path& data_dir() const { return data_dir_; }
  /// The log so far.
  std::string log() const;

  void signal(int number) const;
  /// Waits for the end. Returns the exit code, negative for a signal, or -1000 when it has not ended in time.
  int wait(std::chrono::milliseconds time = std::chrono::seconds(10));

  RawResponse get(const std::string& target, const Headers& headers = {}) const;
  /// Submits an OBJ as raw body and returns the job.
  nlohmann::json submit(const std::string& obj, const std::string& query, const Headers& headers = {}) const;
  /// Follows the event stream until the job has ended, and returns the job.
  nlohmann::json wait_for_end(const std::string& id) const;
  /// Waits until the job is in this state or has ended, and returns the job.
  nlohmann::json wait_for_state(const std::string& id, const std::string& state) const;

 private:
  TemporaryFolder folder_;
  std::filesystem::path data_dir_;
  int pid_ = -1;
  int port_ = 0;
};

/// One event of a stream of server-sent events.
struct ServerEvent {
  std::string id, type, data;
};
std::vector<ServerEvent> parse_events(const std::string& stream);

/// Polls until the condition holds. Returns false when it does not within the time.
bool eventually(const std::function<bool()>& condition, std::chrono::milliseconds time = std::chrono::seconds(10));

}  // namespace crease::test
