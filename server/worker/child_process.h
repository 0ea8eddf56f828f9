#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "server/base/durable_file.h"

namespace creased {

struct ChildOptions {
  std::filesystem::path executable;
  std::vector<std::string> arguments;  ///< without the program's name
  int standard_streams = -1;           ///< becomes standard input and output; -1 for /dev/null and the parent's output
  int standard_error = -1;             ///< -1 for the parent's
  bool with_environment = true;        ///< of the parent; otherwise it is empty
};

/// A child process. The destructor kills and reaps it.
///
/// The kernel also kills it when the *thread* that started it ends, so start children from a thread that outlives them.
/// A child runs in its own process group, so Ctrl-C in a terminal does not reach it. It has default signal handlers,
/// and of its parent's descriptors only those in the options and what these leave as it is.
class ChildProcess {
 public:
  /// \throw crease::Error internal when the program cannot be started
  explicit ChildProcess(const ChildOptions& options);
  ~ChildProcess();
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;

  pid_t id() const { return id_; }
  /// Becomes readable when the child ends.
  int end_descriptor() const { return end_.get(); }
  bool ended();
  /// Waits for the end and describes it, for example "ended with code 1" or "was killed by signal 9 (SIGKILL)".
  std::string wait();
  /// Waits at most `time`. Returns whether the child has ended.
  bool wait_for(std::chrono::milliseconds time);
  void signal(int number) const;

 private:
  pid_t id_ = -1;
  Descriptor end_;
  bool reaped_ = false;
  int status_ = 0;
};

}  // namespace creased
