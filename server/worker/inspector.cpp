#include "server/worker/inspector.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <span>
#include <thread>

#include "crease/v1/compute.pb.h"
#include "server/base/failure.h"
#include "server/worker/sandbox.h"

namespace creased {
namespace v1 = crease::v1;
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kFirstPause{100}, kLongestPause{10'000}, kLeaveGrace{5'000};

crease::Error to_error(const v1::Problem& problem) {
  if (problem.field().empty()) return {problem.code(), problem.detail(), problem.place()};
  return crease::Error::parameter(problem.code(), problem.field(), problem.value(), problem.expected(),
                                  problem.place());
}

v1::ComputeLimits limits_of(const Inspector::Options& options) {
  v1::ComputeLimits limits;
  limits.set_memory_bytes(std::uint64_t{options.memory_limit_mb} << 20U);
  limits.set_cpu_seconds(static_cast<std::uint64_t>(std::chrono::ceil<std::chrono::seconds>(options.timeout).count()));
  limits.set_file_bytes(1);  // an inspection writes no files
  limits.set_max_vertices(options.max_vertices);
  limits.set_max_faces(options.max_faces);
  return limits;
}

}  // namespace

class Inspector::Impl {
 public:
  explicit Impl(const Options& options) : options_(options), keeper_([this] { keep(); }) {}

  ~Impl() {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_all();
    keeper_.join();
  }

  Inspection inspect(v1::ComputeTask task, std::span<const int> files) {
    *task.mutable_limits() = limits_of(options_);
    std::unique_ptr<Sandbox> sandbox = take();
    sandbox->start(task, files);
    const auto deadline = Clock::now() + options_.timeout;
    auto event = sandbox->next_event(deadline);
    if (!event && !sandbox->ended()) {
      discard(std::move(sandbox));
      throw crease::Error(code::kInspectionFailed,
                          fmt::format("checking the mesh took longer than {} ms", options_.timeout.count()));
    }
    // A process that has said what it found has no reason to stay.
    const auto end = std::min(deadline, Clock::now() + kLeaveGrace);
    while (!sandbox->ended() && sandbox->next_event(end)) {
    }
    const auto loss = sandbox->ended() ? sandbox->loss() : std::nullopt;
    sandbox->ended() && sandbox->alive() ? give_back(std::move(sandbox)) : discard(std::move(sandbox));
    return outcome(event, loss);
  }

  void await_start() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !ids_.empty() || !start_error_.empty(); });
    if (ids_.empty()) throw crease::Error(code::kProcessUnavailable, start_error_);
  }

  std::vector<int> process_ids() const {
    const std::lock_guard lock(mutex_);
    return ids_;
  }

 private:
  static Inspection outcome(const std::optional<v1::ComputeEvent>& event, const std::optional<Loss>& loss) {
    if (event && event->refused().code() == code::kMemoryExhausted) {
      throw crease::Error(code::kInspectionFailed, "checking the mesh " + event->refused().detail());
    }
    if (event && event->has_refused()) throw to_error(event->refused());
    if (loss) {
      throw crease::Error(code::kInspectionFailed,
                          fmt::format("the process that was checking the mesh {}", loss->what));
    }
    if (!event || !event->has_inspected()) {
      throw crease::Error(code::kInspectionFailed, "the process that was checking the mesh ended without a result");
    }
    const v1::Inspection& found = event->inspected();
    return {found.facts(), {found.warnings().begin(), found.warnings().end()}};
  }

  std::unique_ptr<Sandbox> take() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return !idle_.empty() || stopping_ || !start_error_.empty(); });
      if (stopping_) throw crease::Error(code::kInspectionFailed, "the service is shutting down");
      if (idle_.empty()) throw crease::Error(code::kProcessUnavailable, start_error_);
      auto sandbox = std::move(idle_.back());
      idle_.pop_back();
      if (sandbox->alive()) return sandbox;
      forget(*sandbox);
    }
  }

  void give_back(std::unique_ptr<Sandbox> sandbox) {
    {
      const std::lock_guard lock(mutex_);
      idle_.push_back(std::move(sandbox));
    }
    changed_.notify_all();
  }

  void discard(std::unique_ptr<Sandbox> sandbox) {
    sandbox->kill();
    spdlog::warn("inspection process {} ended and is replaced", sandbox->process_id());
    const std::lock_guard lock(mutex_);
    forget(*sandbox);
  }

  /// The mutex must be held.
  void forget(const Sandbox& sandbox) {
    std::erase(ids_, sandbox.process_id());
    changed_.notify_all();
  }

  // Starts all sandboxes from one thread, because they die with the thread that started them.
  void keep() {
    auto pause = kFirstPause;
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return stopping_ || ids_.size() < options_.processes; });
      if (stopping_) return;
      lock.unlock();
      const bool started = add_sandbox();
      lock.lock();
      if (started) {
        pause = kFirstPause;
      } else {
        changed_.wait_for(lock, pause, [this] { return stopping_; });
        pause = std::min(pause * 2, kLongestPause);
      }
    }
  }

  bool add_sandbox() {
    std::string error;
    try {
      auto sandbox = std::make_unique<Sandbox>(options_.executable);
      const std::lock_guard lock(mutex_);
      ids_.push_back(sandbox->process_id());
      idle_.push_back(std::move(sandbox));
    } catch (const crease::Error& failed) {
      error = failed.detail();
      spdlog::error("{}", error);
    }
    const std::lock_guard lock(mutex_);
    start_error_ = error;
    changed_.notify_all();
    return error.empty();
  }

  const Options options_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::unique_ptr<Sandbox>> idle_;
  std::vector<int> ids_;     // of idle and busy sandboxes
  std::string start_error_;  // why the last start failed; empty after a success
  bool stopping_ = false;
  std::thread keeper_;
};

Inspector::Inspector(const Options& options) : impl_(std::make_unique<Impl>(options)) {}
Inspector::~Inspector() = default;

Inspection Inspector::inspect(const std::filesystem::path& upload, const std::string& format, const std::string& name,
                              const std::filesystem::path& weights) {
  v1::ComputeTask task;
  task.mutable_inspect()->set_format(format);
  task.mutable_inspect()->set_name(name);
  task.set_has_weights(!weights.empty());
  const Descriptor file = open_to_read(upload), weights_file = weights.empty() ? Descriptor() : open_to_read(weights);
  std::vector<int> files{file.get()};
  if (weights_file.open()) files.push_back(weights_file.get());
  return impl_->inspect(std::move(task), files);
}

void Inspector::await_start() { impl_->await_start(); }

std::vector<int> Inspector::process_ids() const { return impl_->process_ids(); }

}  // namespace creased
