#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/raw_http.h"

namespace crease::test {

/// A folder of its own under the system's, gone at the end.
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

/// A program that was run to its end.
struct Finished {
  int exit_code = -1;  ///< negative: ended by that signal
  std::string output;  ///< standard output
  std::string errors;  ///< standard error
};
Finished run_program(const std::vector<std::string>& command);

/// `creased serve` on loopback at a free port, with a data folder of its own unless `flags` name one; ended, workers
/// and all, with the object.
class ServerProcess {
 public:
  explicit ServerProcess(const std::vector<std::string>& flags = {});
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  int port() const { return port_; }
  int pid() const { return pid_; }
  const std::filesystem::path& data_dir() const { return data_dir_; }
  /// What it has logged so far.
  std::string log() const;

  void signal(int number) const;
  /// The exit code, negative for a signal; -1000 when it has not ended in time.
  int wait(std::chrono::milliseconds time = std::chrono::seconds(10));

  RawResponse get(const std::string& target, const Headers& headers = {}) const;
  /// Submits an OBJ as raw body and returns the job.
  nlohmann::json submit(const std::string& obj, const std::string& query, const Headers& headers = {}) const;
  /// Waits through the event stream until the job has ended, and returns it.
  nlohmann::json wait_for_end(const std::string& id) const;
  /// Waits until the job is in that state, or has ended in another, and returns it.
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

/// Polls until the condition holds; false when it does not within the time.
bool eventually(const std::function<bool()>& condition, std::chrono::milliseconds time = std::chrono::seconds(10));

}  // namespace crease::test
