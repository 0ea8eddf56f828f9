#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "crease/v1/compute.pb.h"
#include "server/base/durable_file.h"
#include "server/store/store.h"
#include "server/worker/child_process.h"

namespace creased {

/// A process (`creased compute`) that forks a confined process for each task. A task can reach only its own files, and
/// its crash does not affect other tasks. Runs one task at a time. The processes have an empty environment, and what
/// they write to standard error comes to this process, which logs a bounded part of it as theirs.
///
/// The process ends with the thread that made this object.
class Sandbox {
 public:
  /// \throw crease::Error internal, process_unavailable when the program cannot be started
  explicit Sandbox(const std::filesystem::path& executable);
  ~Sandbox();
  Sandbox(const Sandbox&) = delete;
  Sandbox& operator=(const Sandbox&) = delete;

  int process_id() const { return process_.id(); }
  /// Whether a task can be started; false when the process has ended.
  bool alive() { return !process_.ended(); }

  /// Starts a task. `files` are the upload, then the weights and the checkpoint if the task has them. They may be
  /// closed afterwards.
  /// \throw crease::Error process_unavailable when the process has ended
  void start(const crease::v1::ComputeTask& task, std::span<const int> files);

  /// The next event of the task; nullopt when none came by `deadline` or the task has ended; see ended().
  std::optional<crease::v1::ComputeEvent> next_event(std::chrono::steady_clock::time_point deadline);
  /// Sends an order. Returns false when the task has ended.
  bool order(const crease::v1::RunOrder& order, std::span<const int> files = {});

  /// Whether the task has ended and all its events were read.
  bool ended() const { return !channel_.open(); }
  /// Waits for the end of the task and returns why it was lost; nullopt when it ended normally. A task that has closed
  /// its channel must end soon after, or it is killed.
  std::optional<Loss> loss();
  /// Kills the task and the process that started it.
  void kill();

 private:
  using Ends = std::pair<Descriptor, Descriptor>;
  Sandbox(const std::filesystem::path& executable, Ends channel, Ends errors);
  void log_errors();

  ChildProcess process_;
  Descriptor requests_;  // channel to the process that starts tasks
  Descriptor errors_;    // what the processes write to standard error
  Descriptor channel_;   // channel to the task
  crease::v1::ComputeLimits limits_;
};

/// Main loop of `creased compute`, which reads tasks from standard input. Returns the exit code.
int run_compute();

}  // namespace creased
