#include "server/worker/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstring>
#include <string_view>
#include <utility>

#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;
namespace {

constexpr int kExecFailed = 127;

// The steps between fork and exec. The parent has threads, so only async-signal-safe functions are allowed here.
struct Launch {
  const char* program;
  char* const* arguments;
  char* const* environment;
  pid_t parent;
  int streams, errors;
  int failure_pipe;

  [[noreturn]] void run() const {
    const int failed = prepare() ? (::execve(program, arguments, environment), errno) : errno;
    [[maybe_unused]] const ssize_t written = ::write(failure_pipe, &failed, sizeof failed);
    ::_exit(kExecFailed);
  }

 private:
  bool prepare() const {
    if (::prctl(PR_SET_PDEATHSIG, SIGKILL) != 0) return false;
    if (::getppid() != parent) ::_exit(kExecFailed);  // the parent ended before the prctl above
    ::setpgid(0, 0);
    offer_to_the_oom_killer();
    reset_signals();
    return redirect() && ::close_range(STDERR_FILENO + 1, UINT_MAX, CLOSE_RANGE_CLOEXEC) == 0;
  }

  // When memory runs out, losing this process costs one attempt of a job; losing the parent would cost the service.
  static void offer_to_the_oom_killer() {
    constexpr std::string_view kScore = "500";
    const int file = ::open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
    if (file < 0) return;
    [[maybe_unused]] const ssize_t written = ::write(file, kScore.data(), kScore.size());
    ::close(file);
  }

  static void reset_signals() {
    struct sigaction standard {};
    standard.sa_handler = SIG_DFL;
    for (int number = 1; number < NSIG; ++number) ::sigaction(number, &standard, nullptr);
    sigset_t none;
    ::sigemptyset(&none);
    ::pthread_sigmask(SIG_SETMASK, &none, nullptr);
  }

  bool redirect() const {
    if (errors >= 0 && ::dup2(errors, STDERR_FILENO) < 0) return false;
    if (streams >= 0) return ::dup2(streams, STDIN_FILENO) >= 0 && ::dup2(streams, STDOUT_FILENO) >= 0;
    const int nothing = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
    return nothing >= 0 && ::dup2(nothing, STDIN_FILENO) >= 0;
  }
};

crease::Error start_failure(const std::filesystem::path& executable, int number) {
  const bool for_now = number == EAGAIN || number == ENOMEM || number == EMFILE || number == ENFILE;
  return {for_now ? code::kProcessUnavailable : code::kInternal,
          fmt::format("cannot start {}: {}", executable.string(), errno_text(number))};
}

// glibc 2.36 declares pidfd_open() without C linkage.
int watch(pid_t process) { return static_cast<int>(::syscall(SYS_pidfd_open, process, 0)); }

std::string describe(int status) {
  if (WIFEXITED(status)) return fmt::format("ended with code {}", WEXITSTATUS(status));
  const char* name = ::sigabbrev_np(WTERMSIG(status));
  return fmt::format("was killed by signal {} (SIG{})", WTERMSIG(status), name == nullptr ? "?" : name);
}

}  // namespace

ChildProcess::ChildProcess(const ChildOptions& options) {
  std::string program = options.executable;
  std::vector<std::string> words = options.arguments;
  std::vector<char*> arguments{program.data()};
  for (auto& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw start_failure(options.executable, errno);
  const Descriptor failure(ends[0]);
  Descriptor failure_writer(ends[1]);
  char* nothing = nullptr;
  const Launch launch{.program = program.c_str(),
                      .arguments = arguments.data(),
                      .environment = options.with_environment ? environ : &nothing,
                      .parent = ::getpid(),
                      .streams = options.standard_streams,
                      .errors = options.standard_error,
                      .failure_pipe = failure_writer.get()};
  id_ = ::fork();
  if (id_ == 0) launch.run();
  if (id_ < 0) throw start_failure(options.executable, errno);
  failure_writer.close();

  int number = 0;
  if (::read(failure.get(), &number, sizeof number) > 0) {
    wait();
    throw start_failure(options.executable, number);
  }
  end_ = Descriptor(watch(id_));
  if (!end_.open()) {
    number = errno;
    signal(SIGKILL);
    wait();
    throw start_failure(options.executable, number);
  }
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : id_(std::exchange(other.id_, -1)), end_(std::move(other.end_)), reaped_(other.reaped_), status_(other.status_) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  std::swap(id_, other.id_);
  std::swap(end_, other.end_);
  std::swap(reaped_, other.reaped_);
  std::swap(status_, other.status_);
  return *this;
}

ChildProcess::~ChildProcess() {
  if (id_ < 0 || reaped_) return;
  signal(SIGKILL);
  wait();
}

bool ChildProcess::ended() {
  if (!reaped_) reaped_ = ::waitpid(id_, &status_, WNOHANG) == id_;
  return reaped_;
}

std::string ChildProcess::wait() {
  while (!reaped_) reaped_ = ::waitpid(id_, &status_, 0) == id_ || errno != EINTR;
  return describe(status_);
}

bool ChildProcess::wait_for(std::chrono::milliseconds time) {
  pollfd end{.fd = end_.get(), .events = POLLIN, .revents = 0};
  const auto deadline = std::chrono::steady_clock::now() + time;
  while (!ended()) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    if (left.count() <= 0) return false;
    ::poll(&end, 1, static_cast<int>(std::min<long long>(left.count(), INT_MAX)));
  }
  return true;
}

void ChildProcess::signal(int number) const {
  if (id_ > 0 && !reaped_) ::kill(id_, number);
}

}  // namespace creased
