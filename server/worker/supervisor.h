#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
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
    /// Told of every worker that has ended: its process, and what became of it.
    std::function<void(int process, const std::string& what)> on_end = {};
  };
  /// \throw crease::Error internal when the executable cannot be started
  explicit Supervisor(const Options& options);
  ~Supervisor();

  /// SIGTERM to all; waits, then SIGKILL to those that are left after `grace_seconds`.
  void stop(double grace_seconds);

  /// Of the workers alive now.
  std::vector<int> process_ids() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace creased
