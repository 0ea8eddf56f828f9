#include "server/worker/inspector.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <condition_variable>
#include <csignal>
#include <mutex>
#include <thread>

#include "crease/v1/inspection.pb.h"
#include "server/store/failure.h"
#include "server/worker/child_process.h"
#include "server/worker/frame.h"

namespace creased {
namespace v1 = crease::v1;
namespace {

constexpr std::chrono::milliseconds kFirstPause{100}, kLongestPause{10'000};

struct Helper {
  ChildProcess process;
  Descriptor stream;
};

Helper start_helper(const Inspector::Options& options) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    throw crease::Error(code::kInternal, "cannot make a socket pair: " + errno_text(errno));
  }
  Descriptor ours(ends[0]);
  const Descriptor theirs(ends[1]);
  ChildProcess process({.executable = options.executable,
                        .arguments = {"inspect", "--max-vertices", std::to_string(options.max_vertices), "--max-faces",
                                      std::to_string(options.max_faces)},
                        .memory_limit_mb = options.memory_limit_mb,
                        .standard_streams = theirs.get()});
  return {std::move(process), std::move(ours)};
}

crease::Error to_error(const v1::Problem& problem) {
  if (problem.field().empty()) return {problem.code(), problem.detail(), problem.place()};
  return crease::Error::parameter(problem.code(), problem.field(), problem.value(), problem.expected(),
                                  problem.place());
}

Inspection to_inspection(const v1::InspectResponse& response) {
  if (response.has_error()) throw to_error(response.error());
  return {response.facts(), {response.warnings().begin(), response.warnings().end()}};
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

  Inspection inspect(const v1::InspectRequest& request) {
    Helper helper = take();
    v1::InspectResponse response;
    const auto deadline = std::chrono::steady_clock::now() + options_.timeout;
    const FrameOutcome outcome = write_frame(helper.stream.get(), request)
                                     ? read_frame(helper.stream.get(), response, deadline)
                                     : FrameOutcome::kEnded;
    if (outcome != FrameOutcome::kRead) throw failure(std::move(helper), outcome);
    give_back(std::move(helper));
    return to_inspection(response);
  }

  std::vector<int> process_ids() const {
    const std::lock_guard lock(mutex_);
    return ids_;
  }

 private:
  Helper take() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return !idle_.empty() || stopping_ || !start_error_.empty(); });
      if (stopping_) throw crease::Error(code::kInspectionFailed, "the service is stopping");
      if (idle_.empty()) throw crease::Error(code::kInspectionFailed, start_error_);
      Helper helper = std::move(idle_.back());
      idle_.pop_back();
      if (!helper.process.ended()) return helper;
      forget(helper);
    }
  }

  void give_back(Helper helper) {
    {
      const std::lock_guard lock(mutex_);
      idle_.push_back(std::move(helper));
    }
    changed_.notify_all();
  }

  crease::Error failure(Helper helper, FrameOutcome outcome) {
    helper.process.signal(SIGKILL);
    const std::string end = helper.process.wait();
    spdlog::warn("inspector process {} {}", helper.process.id(), end);
    {
      const std::lock_guard lock(mutex_);
      forget(helper);
    }
    if (outcome == FrameOutcome::kTimedOut) {
      return {code::kInspectionFailed,
              fmt::format("checking the mesh took longer than {} ms", options_.timeout.count())};
    }
    return {code::kInspectionFailed, fmt::format("the process that checked the mesh {}", end)};
  }

  /// Under the mutex.
  void forget(const Helper& helper) {
    std::erase(ids_, helper.process.id());
    changed_.notify_all();
  }

  // The one thread that starts helpers: they live no longer than it does.
  void keep() {
    auto pause = kFirstPause;
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return stopping_ || ids_.size() < options_.processes; });
      if (stopping_) return;
      lock.unlock();
      const bool started = add_helper();
      lock.lock();
      if (started) {
        pause = kFirstPause;
      } else {
        changed_.wait_for(lock, pause, [this] { return stopping_; });
        pause = std::min(pause * 2, kLongestPause);
      }
    }
  }

  bool add_helper() {
    std::string error;
    try {
      Helper helper = start_helper(options_);
      const std::lock_guard lock(mutex_);
      ids_.push_back(helper.process.id());
      idle_.push_back(std::move(helper));
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
  std::vector<Helper> idle_;
  std::vector<int> ids_;     // of idle and busy helpers
  std::string start_error_;  // why the last start failed; empty: it did not
  bool stopping_ = false;
  std::thread keeper_;
};

Inspector::Inspector(const Options& options) : impl_(std::make_unique<Impl>(options)) {}
Inspector::~Inspector() = default;

Inspection Inspector::inspect(const std::filesystem::path& upload, const std::string& format, const std::string& name,
                              const std::filesystem::path& weights) {
  v1::InspectRequest request;
  request.set_path(upload);
  request.set_format(format);
  request.set_name(name);
  request.set_weights(weights);
  return impl_->inspect(request);
}

std::vector<int> Inspector::process_ids() const { return impl_->process_ids(); }

}  // namespace creased
