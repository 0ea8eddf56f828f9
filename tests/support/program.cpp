#include "tests/support/program.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "tests/support/meshes.h"

namespace crease::test {
namespace {

int spawn(const std::vector<std::string>& command, const std::filesystem::path& output,
          const std::filesystem::path& errors) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, output.c_str(), O_CREAT | O_WRONLY | O_APPEND, 0600);
  posix_spawn_file_actions_addopen(&actions, 2, errors.c_str(), O_CREAT | O_WRONLY | O_APPEND, 0600);
  std::vector<char*> arguments;
  for (const auto& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  pid_t pid = -1;
  const int error = ::posix_spawn(&pid, arguments.front(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) throw std::runtime_error("cannot start " + command.front());
  return pid;
}

}  // namespace

Program::Program(const std::vector<std::string>& command)
    : pid_(spawn(command, folder_.path() / "output", folder_.path() / "errors")) {}

Program::~Program() {
  if (ended()) return;
  signal(SIGKILL);
  wait();
}

void Program::signal(int number) const {
  if (pid_ > 0) ::kill(pid_, number);
}

int Program::wait(std::chrono::milliseconds time) {
  if (pid_ < 0) return exit_code_;
  int status = 0;
  if (!eventually([&] { return ::waitpid(pid_, &status, WNOHANG) == pid_; }, time)) return kStillRuns;
  pid_ = -1;
  exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  return exit_code_;
}

std::string Program::output() const { return read_file(folder_.path() / "output"); }
std::string Program::errors() const { return read_file(folder_.path() / "errors"); }

Finished run_program(const std::vector<std::string>& command) {
  Program program(command);
  const int exit_code = program.wait();
  return {exit_code, program.output(), program.errors()};
}

std::vector<int> children_of(int process) {
  std::vector<int> all;
  std::error_code gone;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task", gone)) {
    std::ifstream list(thread.path() / "children");
    all.insert(all.end(), std::istream_iterator<int>(list), {});
  }
  return all;
}

bool is_alive(int process) {
  std::ifstream stat("/proc/" + std::to_string(process) + "/stat");
  std::string line;
  std::getline(stat, line);
  const auto name_end = line.rfind(") ");
  return name_end != std::string::npos && line.substr(name_end + 2, 1) != "Z";
}

}  // namespace crease::test
