#pragma once

#include <string>
#include <vector>

#include "tests/support/patience.h"
#include "tests/support/temporary_folder.h"

namespace crease::test {

/// A running program. The destructor kills it unless it has ended.
class Program {
 public:
  explicit Program(const std::vector<std::string>& command);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  static constexpr int kStillRuns = -1000;

  /// -1 after `wait` has seen its end.
  int pid() const { return pid_; }
  void signal(int number) const;
  /// Returns the exit code, negative for a signal, or kStillRuns when it has not ended in time.
  int wait(std::chrono::milliseconds time = kPatience);
  bool ended() { return pid_ < 0 || wait(std::chrono::milliseconds(0)) != kStillRuns; }

  /// What it has written so far to standard output and standard error.
  std::string output() const;
  std::string errors() const;

 private:
  TemporaryFolder folder_;
  int pid_ = -1;
  int exit_code_ = 0;
};

/// The outcome of a program.
struct Finished {
  int exit_code = -1;  ///< negative for the number of a signal
  std::string output;  ///< standard output
  std::string errors;  ///< standard error
};
Finished run_program(const std::vector<std::string>& command);

/// The child processes of all threads of `process`.
std::vector<int> children_of(int process);

/// Whether the process exists and is not a zombie.
bool is_alive(int process);

}  // namespace crease::test
