#pragma once

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "crease/v1/compute.pb.h"
#include "server/jobs/turns.h"
#include "server/worker/sandbox.h"

namespace creased {

/// A few confined processes for short tasks of the HTTP process: inspections and encodings. What does not get a process
/// at once waits for its turn; see Turns for the order.
class TaskPool {
 public:
  struct Options {
    std::filesystem::path executable;  ///< the creased program, run as `creased compute`
    std::size_t processes = 3;
    std::chrono::milliseconds large{500};  ///< work that leaves one process free for smaller work
  };
  explicit TaskPool(const Options& options);
  ~TaskPool();
  TaskPool(const TaskPool&) = delete;
  TaskPool& operator=(const TaskPool&) = delete;

  /// Who wants a task done, and what bounds it.
  struct Asker {
    std::string owner;
    /// Whether nobody wants the outcome any more; asked about ten times a second. Null for never.
    std::function<bool()> left = nullptr;
  };
  struct Outcome {
    std::optional<crease::v1::ComputeEvent> event;  ///< the last one of the task
    std::optional<Loss> loss;                       ///< why the process ended early
    std::chrono::milliseconds late{0};              ///< the time-out, when the task took longer and was killed
    bool left = false;                              ///< nobody wanted the outcome any more; the task was killed
  };

  /// Runs a task on the open `files`; waits for a free process first. `timeout` counts from its start.
  /// \throw crease::Error process_unavailable when no process can be started, shutting_down
  Outcome run(const Asker& asker, const crease::v1::ComputeTask& task, std::span<const int> files,
              std::chrono::milliseconds work, std::chrono::milliseconds timeout);

  /// What a task has said at its end.
  /// \throw crease::Error as the task refused; or with `code_of_fault` and a detail that begins with `what`, when it
  /// exceeded a limit, crashed, or did not say what was expected
  static const crease::v1::ComputeEvent& event_of(const Outcome& outcome, crease::v1::ComputeEvent::EventCase expected,
                                                  crease::ErrorCode code_of_fault, const std::string& what);

  /// Waits for the first process. \throw crease::Error when it cannot be started
  void await_start();

  /// The ids of the processes.
  std::vector<int> process_ids() const;
  /// How many tasks wait for their turn.
  std::size_t waiting() const;

 private:
  using Ticket = Turns::Ticket;
  class Turn;

  void hand_out();
  std::unique_ptr<Sandbox> await_turn(Ticket ticket, const Asker& asker);
  void give_back(Ticket ticket, std::unique_ptr<Sandbox> sandbox);
  void forget(const Sandbox& sandbox);
  void keep();
  bool add_sandbox();

  const Options options_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Turns turns_;
  std::vector<std::unique_ptr<Sandbox>> idle_;
  std::map<Ticket, std::unique_ptr<Sandbox>> handed_out_;  // not yet taken by who waits for it
  std::vector<int> ids_;                                   // of idle and busy sandboxes
  std::string start_error_;                                // why the last start failed; empty after a success
  bool stopping_ = false;
  std::thread keeper_;
};

}  // namespace creased
