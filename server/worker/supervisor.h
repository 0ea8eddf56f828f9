#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace creased {

/// Keeps N worker processes running. It restarts those that die, with a growing pause for those that die at once, and
/// stop() lets them return their jobs to the queue. The workers die with this process, however it ends.
class Supervisor {
 public:
  struct Options {
    std::filesystem::path executable;    ///< the creased program
    std::vector<std::string> arguments;  ///< "worker", "--data-dir", …
    std::size_t processes = 1;
    /// Called for every worker that has ended, with its process id and how it ended.
    std::function<void(int process, const std::string& what)> on_end = {};
  };
  /// \throw crease::Error internal when the executable cannot be started
  explicit Supervisor(const Options& options);
  ~Supervisor();

  /// Sends SIGTERM to all workers, and SIGKILL to those that still run after `grace_seconds`.
  void stop(double grace_seconds);

  /// The process ids of the running workers.
  std::vector<int> process_ids() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace creased
