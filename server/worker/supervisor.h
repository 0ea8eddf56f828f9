#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace creased {

/// Keeps N worker processes alive: starts them, starts them again when they die (with a growing pause when they die
/// at once), and on stop() lets them put their jobs back. They die with this process, however it ends.
class Supervisor {
 public:
  struct Options {
    std::filesystem::path executable;    ///< creased itself
    std::vector<std::string> arguments;  ///< "worker", "--data-dir", …
    std::size_t processes = 1;
  };
  explicit Supervisor(const Options& options);
  ~Supervisor();

  /// SIGTERM to all; waits, then SIGKILL to those that are left after `grace_seconds`.
  void stop(double grace_seconds);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace creased
