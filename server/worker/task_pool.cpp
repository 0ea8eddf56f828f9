#include "server/worker/task_pool.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "proto/error_table.h"
#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;
namespace v1 = crease::v1;
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kFirstPause{100}, kLongestPause{10'000};
constexpr milliseconds kLeaveGrace{5'000};  // of a process that has said what it found
constexpr milliseconds kLookEvery{100};

}  // namespace

/// A process for one task. The constructor waits for it.
class TaskPool::Turn {
 public:
  Turn(TaskPool& pool, const Asker& asker, milliseconds work) : pool_(pool) {
    {
      const std::lock_guard lock(pool_.mutex_);
      ticket_ = pool_.turns_.enter(asker.owner, work);
      pool_.hand_out();
    }
    try {
      sandbox_ = pool_.await_turn(ticket_, asker);
    } catch (...) {
      pool_.give_back(ticket_, nullptr);
      throw;
    }
  }
  ~Turn() { pool_.give_back(ticket_, std::move(sandbox_)); }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

  /// Null when the asker has left before its turn.
  Sandbox* sandbox() { return sandbox_.get(); }

 private:
  TaskPool& pool_;
  Ticket ticket_ = 0;
  std::unique_ptr<Sandbox> sandbox_;
};

TaskPool::TaskPool(const Options& options)
    : options_(options), turns_(options.processes, options.large), keeper_([this] { keep(); }) {}

TaskPool::~TaskPool() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  keeper_.join();
}

TaskPool::Outcome TaskPool::run(const Asker& asker, const v1::ComputeTask& task, std::span<const int> files,
                                milliseconds work, milliseconds timeout) {
  Outcome outcome;
  const auto left = [&] { return outcome.left = outcome.left || (asker.left && asker.left()); };
  Turn turn(*this, asker, work);
  Sandbox* const sandbox = turn.sandbox();
  outcome.left = sandbox == nullptr;
  if (outcome.left) return outcome;
  sandbox->start(task, files);
  const auto deadline = Clock::now() + timeout;
  while (!outcome.event && !sandbox->ended() && Clock::now() < deadline && !left()) {
    outcome.event = sandbox->next_event(std::min(deadline, Clock::now() + kLookEvery));
  }
  if (!outcome.left && !outcome.event && !sandbox->ended()) outcome.late = timeout;
  if (outcome.late.count() > 0 || outcome.left) {
    sandbox->kill();
    return outcome;
  }
  // A process that has said what it found has no reason to stay.
  const auto end = std::min(deadline, Clock::now() + kLeaveGrace);
  while (!sandbox->ended() && sandbox->next_event(end)) {
  }
  if (sandbox->ended()) {
    outcome.loss = sandbox->loss();
  } else {
    sandbox->kill();
  }
  return outcome;
}

const v1::ComputeEvent& TaskPool::event_of(const Outcome& outcome, v1::ComputeEvent::EventCase expected,
                                           crease::ErrorCode code_of_fault, const std::string& what) {
  const auto fail = [&](const std::string& why) { throw crease::Error(code_of_fault, what + " " + why); };
  if (outcome.late.count() > 0) fail(fmt::format("took longer than {} ms", outcome.late.count()));
  if (outcome.event && outcome.event->has_refused()) {
    const crease::Error error = crease::to_error(outcome.event->refused());
    if (is_limit_of_job(error.code())) fail(error.detail());
    throw error;
  }
  if (outcome.loss) fail("failed: the process " + outcome.loss->what);
  if (!outcome.event || outcome.event->event_case() != expected) fail("failed: the process did not say how it went");
  return *outcome.event;
}

/// Gives free processes to those whose turn it is. The mutex must be held.
void TaskPool::hand_out() {
  while (!idle_.empty()) {
    if (!idle_.back()->alive()) {
      forget(*idle_.back());
      idle_.pop_back();
      continue;
    }
    const auto ticket = turns_.next();
    if (!ticket) return;
    handed_out_[*ticket] = std::move(idle_.back());
    idle_.pop_back();
    changed_.notify_all();
  }
}

std::unique_ptr<Sandbox> TaskPool::await_turn(Ticket ticket, const Asker& asker) {
  std::unique_lock lock(mutex_);
  for (;;) {
    if (const auto mine = handed_out_.find(ticket); mine != handed_out_.end()) {
      auto sandbox = std::move(mine->second);
      handed_out_.erase(mine);
      return sandbox;
    }
    if (stopping_) throw crease::Error(code::kShuttingDown, "the service is shutting down");
    if (ids_.empty() && !start_error_.empty()) throw crease::Error(code::kProcessUnavailable, start_error_);
    changed_.wait_for(lock, kLookEvery);
    if (!asker.left) continue;
    lock.unlock();
    const bool left = asker.left();
    lock.lock();
    if (left && !handed_out_.contains(ticket)) return nullptr;
  }
}

void TaskPool::give_back(Ticket ticket, std::unique_ptr<Sandbox> sandbox) {
  const std::lock_guard lock(mutex_);
  turns_.leave(ticket);
  if (const auto unused = handed_out_.extract(ticket); !unused.empty()) sandbox = std::move(unused.mapped());
  if (sandbox != nullptr && sandbox->ended() && sandbox->alive()) {
    idle_.push_back(std::move(sandbox));
  } else if (sandbox != nullptr) {
    spdlog::warn("the process {} for inspections and encodings ended and is replaced", sandbox->process_id());
    forget(*sandbox);
  }
  hand_out();
}

/// The mutex must be held.
void TaskPool::forget(const Sandbox& sandbox) {
  std::erase(ids_, sandbox.process_id());
  changed_.notify_all();
}

void TaskPool::await_start() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !ids_.empty() || !start_error_.empty(); });
  if (ids_.empty()) throw crease::Error(code::kProcessUnavailable, start_error_);
}

std::vector<int> TaskPool::process_ids() const {
  const std::lock_guard lock(mutex_);
  return ids_;
}

std::size_t TaskPool::waiting() const {
  const std::lock_guard lock(mutex_);
  return turns_.waiting();
}

// Starts all sandboxes from one thread, because they die with the thread that started them.
void TaskPool::keep() {
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

bool TaskPool::add_sandbox() {
  std::string error;
  try {
    auto sandbox = std::make_unique<Sandbox>(options_.executable);
    const std::lock_guard lock(mutex_);
    ids_.push_back(sandbox->process_id());
    idle_.push_back(std::move(sandbox));
    hand_out();
  } catch (const crease::Error& failed) {
    error = failed.detail();
    spdlog::error("{}", error);
  }
  const std::lock_guard lock(mutex_);
  start_error_ = error;
  changed_.notify_all();
  return error.empty();
}

}  // namespace creased
