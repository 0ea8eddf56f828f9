#include "tests/support/server_process.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "tests/support/meshes.h"

namespace crease::test {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook{5};

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

int exit_code_of(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status); }

}  // namespace

TemporaryFolder::TemporaryFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "creased-test-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make a temporary folder");
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

bool eventually(const std::function<bool()>& condition, std::chrono::milliseconds time) {
  const auto deadline = Clock::now() + time;
  while (!condition()) {
    if (Clock::now() > deadline) return false;
    ::poll(nullptr, 0, static_cast<int>(kLook.count()));
  }
  return true;
}

Finished run_program(const std::vector<std::string>& command) {
  const TemporaryFolder folder;
  const auto output = folder.path() / "output", errors = folder.path() / "errors";
  const int pid = spawn(command, output, errors);
  int status = 0;
  ::waitpid(pid, &status, 0);
  return {exit_code_of(status), read_file(output), read_file(errors)};
}

ServerProcess::ServerProcess(const std::vector<std::string>& flags) : data_dir_(folder_.path() / "data") {
  const auto port_file = folder_.path() / "port";
  std::vector<std::string> command = {CREASED_BIN, "serve", "--port", "0", "--port-file", port_file.string()};
  command.insert(command.end(), flags.begin(), flags.end());
  if (const auto given = std::find(flags.begin(), flags.end(), "--data-dir"); given != flags.end()) {
    data_dir_ = *(given + 1);
  } else {
    command.insert(command.end(), {"--data-dir", data_dir_.string()});
  }
  pid_ = spawn(command, folder_.path() / "output", folder_.path() / "log");
  const bool ready =
      eventually([&] { return std::filesystem::exists(port_file) || ::waitpid(pid_, nullptr, WNOHANG) == pid_; },
                 std::chrono::seconds(30));
  if (!ready || !std::filesystem::exists(port_file)) throw std::runtime_error("creased does not start: " + log());
  port_ = std::stoi(read_file(port_file));
}

ServerProcess::~ServerProcess() {
  if (pid_ < 0) return;
  signal(SIGTERM);
  if (wait(std::chrono::seconds(10)) != -1000) return;
  signal(SIGKILL);
  wait();
}

std::string ServerProcess::log() const { return read_file(folder_.path() / "log"); }

void ServerProcess::signal(int number) const {
  if (pid_ > 0) ::kill(pid_, number);
}

int ServerProcess::wait(std::chrono::milliseconds time) {
  int status = 0;
  if (!eventually([&] { return ::waitpid(pid_, &status, WNOHANG) == pid_; }, time)) return -1000;
  pid_ = -1;
  return exit_code_of(status);
}

RawResponse ServerProcess::get(const std::string& target, const Headers& headers) const {
  return exchange(port_, "GET", target, headers);
}

nlohmann::json ServerProcess::submit(const std::string& obj, const std::string& query, const Headers& headers) const {
  Headers all = headers;
  all.emplace_back("Content-Type", "model/obj");
  const auto response = exchange(port_, "POST", "/v1/jobs" + (query.empty() ? "" : "?" + query), all, obj);
  if (response.status != 202 && response.status != 200) throw std::runtime_error("not submitted: " + response.body);
  return response.json();
}

nlohmann::json ServerProcess::wait_for_end(const std::string& id) const {
  const auto events = parse_events(get("/v1/jobs/" + id + "/events").body);
  if (events.empty()) throw std::runtime_error("no events of " + id);
  return nlohmann::json::parse(events.back().data);
}

nlohmann::json ServerProcess::wait_for_state(const std::string& id, const std::string& state) const {
  nlohmann::json job;
  const bool reached = eventually(
      [&] {
        job = get("/v1/jobs/" + id).json();
        return job["state"] == state || (job["state"] != "queued" && job["state"] != "running");
      },
      std::chrono::seconds(60));
  if (!reached) throw std::runtime_error(id + " does not become " + state);
  return job;
}

std::vector<ServerEvent> parse_events(const std::string& stream) {
  std::vector<ServerEvent> events;
  std::istringstream lines(stream);
  ServerEvent event;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty()) {
      if (!event.data.empty()) events.push_back(event);
      event = {};
    } else if (line.starts_with("id: ")) {
      event.id = line.substr(4);
    } else if (line.starts_with("event: ")) {
      event.type = line.substr(7);
    } else if (line.starts_with("data: ")) {
      event.data += line.substr(6);
    }
  }
  return events;
}

}  // namespace crease::test
