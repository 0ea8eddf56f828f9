#include "server/worker/supervisor.h"

#include <fmt/format.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <future>
#include <mutex>
#include <optional>
#include <thread>

#include "server/base/failure.h"
#include "server/worker/child_process.h"

namespace creased {
namespace code = crease::code;
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kFirstRestartPause{100}, kLongestRestartPause{10'000};
constexpr std::chrono::seconds kSoundLife{5};

/// The place of one worker.
struct Post {
  std::optional<ChildProcess> child;
  Clock::time_point started, start_at;
  std::chrono::milliseconds pause{0};  // before the next start
};

std::chrono::milliseconds next_pause(const Post& post, Clock::time_point now) {
  if (now - post.started >= kSoundLife) return std::chrono::milliseconds{0};
  return std::clamp(post.pause * 2, kFirstRestartPause, kLongestRestartPause);
}

}  // namespace

class Supervisor::Impl {
 public:
  explicit Impl(const Options& options)
      : child_{.executable = options.executable, .arguments = options.arguments, .standard_streams = -1},
        on_end_(options.on_end),
        posts_(options.processes),
        wake_(::eventfd(0, EFD_CLOEXEC)) {
    if (!wake_.open()) throw crease::Error(code::kInternal, "cannot make an event: " + errno_text(errno));
    std::promise<void> started;
    auto outcome = started.get_future();
    thread_ = std::thread([this, promise = std::move(started)]() mutable { run(promise); });
    try {
      outcome.get();
    } catch (...) {
      thread_.join();
      throw;
    }
  }

  ~Impl() { stop(0); }

  void stop(double grace_seconds) {
    if (!thread_.joinable()) return;
    grace_ = std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::duration<double>(grace_seconds));
    ::eventfd_write(wake_.get(), 1);
    thread_.join();
  }

  std::vector<int> process_ids() const {
    const std::lock_guard lock(mutex_);
    std::vector<int> ids;
    for (const Post& post : posts_) {
      if (post.child) ids.push_back(post.child->id());
    }
    return ids;
  }

 private:
  // Starts all workers from one thread, because they die with the thread that started them.
  void run(std::promise<void>& started) {
    try {
      for (Post& post : posts_) start(post);
      started.set_value();
    } catch (...) {
      posts_.clear();
      started.set_exception(std::current_exception());
      return;
    }
    while (!wait_for_event()) {
      for (Post& post : posts_) tend(post);
    }
    end_all();
  }

  void start(Post& post) {
    ChildProcess child(child_);
    spdlog::info("worker process {} started", child.id());
    const std::lock_guard lock(mutex_);
    post.started = Clock::now();
    post.child = std::move(child);
  }

  void tend(Post& post) {
    const auto now = Clock::now();
    if (post.child && post.child->ended()) {
      post.pause = next_pause(post, now);
      post.start_at = now + post.pause;
      const int process = post.child->id();
      const std::string what = post.child->wait();
      spdlog::warn("worker process {} {}; its replacement starts in {} ms", process, what, post.pause.count());
      if (on_end_) on_end_(process, what);
      const std::lock_guard lock(mutex_);
      post.child.reset();
    }
    if (post.child || now < post.start_at) return;
    try {
      start(post);
    } catch (const crease::Error& error) {
      post.started = now;
      post.pause = next_pause(post, now);
      post.start_at = now + post.pause;
      spdlog::error("{}", error.detail());
    }
  }

  /// Waits for an event. Returns true when it is stop().
  bool wait_for_event() {
    std::vector<pollfd> events{{.fd = wake_.get(), .events = POLLIN, .revents = 0}};
    auto until = Clock::time_point::max();
    for (const Post& post : posts_) {
      if (post.child) {
        events.push_back({.fd = post.child->end_descriptor(), .events = POLLIN, .revents = 0});
      } else {
        until = std::min(until, post.start_at);
      }
    }
    int timeout_ms = -1;
    if (until != Clock::time_point::max()) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
      timeout_ms = static_cast<int>(std::max<std::int64_t>(left, 0));
    }
    ::poll(events.data(), events.size(), timeout_ms);
    return events.front().revents != 0;
  }

  void end_all() {
    for (Post& post : posts_) {
      if (post.child) post.child->signal(SIGTERM);
    }
    const auto deadline = Clock::now() + grace_.load();
    for (Post& post : posts_) {
      if (!post.child) continue;
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
      if (!post.child->wait_for(left)) {
        spdlog::warn("worker process {} did not stop in time and is killed", post.child->id());
      }
      const std::lock_guard lock(mutex_);
      post.child.reset();
    }
  }

  ChildOptions child_;
  std::function<void(int, const std::string&)> on_end_;
  mutable std::mutex mutex_;  // guards the posts' children, which the thread changes and others read
  std::vector<Post> posts_;
  Descriptor wake_;
  std::atomic<std::chrono::milliseconds> grace_{std::chrono::milliseconds(0)};
  std::thread thread_;
};

Supervisor::Supervisor(const Options& options) : impl_(std::make_unique<Impl>(options)) {}
Supervisor::~Supervisor() = default;
void Supervisor::stop(double grace_seconds) { impl_->stop(grace_seconds); }
std::vector<int> Supervisor::process_ids() const { return impl_->process_ids(); }

}  // namespace creased
