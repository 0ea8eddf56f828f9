#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "server/store/durable_file.h"

namespace creased {

struct ChildOptions {
  std::filesystem::path executable;
  std::vector<std::string> arguments;  ///< after the program's name
  int standard_streams = -1;           ///< becomes standard input and output; -1: /dev/null and the parent's output
};

/// A child process, killed and reaped when the object goes.
///
/// The kernel kills it, too, when the *thread* that started it ends, however that comes about: start children from a
/// thread that lives as long as they may. A child starts in a process group of its own (the terminal's Ctrl-C is not
/// for it), with default signals, and with no descriptor of its parent but standard error and those named in the
/// options.
class ChildProcess {
 public:
  /// \throw crease::Error internal when the program cannot be started, with the reason
  explicit ChildProcess(const ChildOptions& options);
  ~ChildProcess();
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;

  pid_t id() const { return id_; }
  /// Readable once the child has ended.
  int end_descriptor() const { return end_.get(); }
  bool ended();
  /// Waits. What became of it: "ended with code 1", "was killed by signal 9 (Killed)".
  std::string wait();
  /// wait() if it ends in time.
  bool wait_for(std::chrono::milliseconds time);
  void signal(int number) const;

 private:
  pid_t id_ = -1;
  Descriptor end_;
  bool reaped_ = false;
  int status_ = 0;
};

}  // namespace creased
