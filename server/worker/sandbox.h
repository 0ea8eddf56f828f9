#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "crease/v1/compute.pb.h"
#include "server/store/durable_file.h"
#include "server/store/store.h"
#include "server/worker/child_process.h"

namespace creased {

/// A process (`creased compute`) that starts a fresh, confined process for every task: it knows nothing but the files
/// of its task, and what becomes of it stays its own affair. One task at a time.
///
/// The process lives no longer than the thread that made this object.
class Sandbox {
 public:
  /// \throw crease::Error internal when the program cannot be started
  explicit Sandbox(const std::filesystem::path& executable);

  int process_id() const { return process_.id(); }
  /// Whether a task can be started; false once the process is gone.
  bool alive() { return !process_.ended(); }

  /// Starts a task. `files` are the upload, then weights and checkpoint as the task says; they may be closed at once.
  /// \throw crease::Error internal when the process is gone
  void start(const crease::v1::ComputeTask& task, std::span<const int> files);

  /// The next event of the task; nullopt when none came by `deadline`, or will ever come: see ended().
  std::optional<crease::v1::ComputeEvent> next_event(std::chrono::steady_clock::time_point deadline);
  /// False: the task does not listen any more.
  bool order(const crease::v1::RunOrder& order, std::span<const int> files = {});

  /// Whether the task has ended and all of its events were read.
  bool ended() const { return !channel_.open(); }
  /// How it ended, once it has; waits for that. Empty: by itself and in order.
  std::optional<Loss> loss();
  /// Ends a task by force, and this process with it.
  void kill();

 private:
  Sandbox(const std::filesystem::path& executable, std::pair<Descriptor, Descriptor> ends);

  ChildProcess process_;
  Descriptor requests_;  // to the process that starts tasks
  Descriptor channel_;   // to the task
  crease::v1::ComputeLimits limits_;
};

/// Main loop of `creased compute`: tasks come on standard input. Returns the exit code.
int run_compute();

}  // namespace creased
