#include "server/worker/worker.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <climits>
#include <condition_variable>
#include <csignal>
#include <fstream>
#include <mutex>
#include <optional>
#include <thread>

#include "core/error.h"
#include "proto/convert.h"
#include "server/worker/job_run.h"
#include "server/worker/sandbox.h"

namespace creased {
namespace {

constexpr std::chrono::milliseconds kLongestPollPause{2'000};
constexpr std::chrono::seconds kPulse{2};

/// Tells the store from its own thread that a worker lives, and why it cannot run jobs if it cannot.
class Pulse {
 public:
  Pulse(Store& store, std::string name)
      : store_(store), name_(std::move(name)), thread_([this](const std::stop_token& ended) { beat(ended); }) {}

  void set_problem(const std::string& problem) {
    const std::lock_guard lock(mutex_);
    if (problem == problem_) return;
    problem_ = problem;
    changed_ = true;
    wake_.notify_all();
  }

 private:
  void beat(const std::stop_token& ended) {
    std::unique_lock lock(mutex_);
    do {
      changed_ = false;
      const std::string problem = problem_;
      lock.unlock();
      try {
        store_.note_worker(name_, problem);
      } catch (const crease::Error& error) {
        spdlog::debug("worker {}: {}", name_, error.detail());  // silence tells the store's readers as much
      }
      lock.lock();
      wake_.wait_for(lock, ended, kPulse, [this] { return changed_; });
    } while (!ended.stop_requested());
  }

  Store& store_;
  const std::string name_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::string problem_;
  bool changed_ = false;
  std::jthread thread_;
};

/// Runs the next job, if any. Returns whether there was one.
bool run_next(Store& store, const WorkerOptions& options, std::optional<Sandbox>& sandbox,
              const std::atomic<bool>& stop) {
  if (!sandbox || !sandbox->alive()) sandbox.emplace(options.executable);
  auto claim = store.claim(options.name, options.lease);
  if (!claim) return false;
  JobRun(store, options, *sandbox, std::move(*claim), stop).run();
  return true;
}

/// Whether a process has ended; a zombie counts as ended.
bool is_gone(pid_t process) {
  if (::kill(process, 0) != 0) return errno == ESRCH;
  std::ifstream stat(fmt::format("/proc/{}/stat", process));
  std::string line;
  std::getline(stat, line);
  const auto name_end = line.rfind(") ");
  return name_end != std::string::npos && line.substr(name_end + 2, 1) == "Z";
}

/// What only processes that see each other's numbers have in common: the start of the system and the namespace.
std::string place_of_processes() {
  constexpr std::size_t kDigits = 8;
  std::ifstream file("/proc/sys/kernel/random/boot_id");
  std::string boot;
  std::getline(file, boot);
  std::error_code unknown;
  const auto space = std::filesystem::read_symlink("/proc/self/ns/pid", unknown);
  return crease::sha256_hex(boot + space.string()).substr(0, kDigits);
}

}  // namespace

std::string worker_name(int process, bool shared) {
  std::string host(HOST_NAME_MAX + 1, '\0');
  ::gethostname(host.data(), host.size() - 1);
  host.resize(host.find('\0'));
  return shared ? fmt::format("{}-{}-{}", host, place_of_processes(), process) : fmt::format("{}-{}", host, process);
}

bool is_dead_worker(const std::string& name, bool shared) {
  const std::string anyone = worker_name(0, shared), of_host = anyone.substr(0, anyone.size() - 1);
  int process = 0;
  const char* const end = name.data() + name.size();
  if (!name.starts_with(of_host)) return false;
  const auto [stop, failed] = std::from_chars(name.data() + of_host.size(), end, process);
  return stop == end && failed == std::errc() && process > 0 && is_gone(process);
}

int run_worker(Store& store, const WorkerOptions& options, const std::atomic<bool>& stop) {
  auto pause = options.poll;
  std::optional<Sandbox> sandbox;
  Pulse pulse(store, options.name);
  while (!stop) {
    try {
      const bool ran = run_next(store, options, sandbox, stop);
      pulse.set_problem({});
      if (ran) continue;
      pause = options.poll;
    } catch (const crease::Error& error) {
      spdlog::error("worker {}: {}", options.name, error.detail());
      pulse.set_problem(error.detail());
      pause = std::min(pause * 2, kLongestPollPause);
    }
    std::this_thread::sleep_for(pause);
  }
  return 0;
}

}  // namespace creased
