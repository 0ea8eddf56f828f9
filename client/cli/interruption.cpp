#include "client/cli/interruption.h"

#include <csignal>
#include <cstdlib>

#include "client/cli/failure.h"

namespace crease::client {
namespace {

// Wakes the watching thread when the object is destroyed. The signal is ignored by default, so a late one does no harm.
constexpr int kWake = SIGWINCH;

sigset_t watched_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : {SIGINT, SIGTERM, kWake}) sigaddset(&signals, number);
  return signals;
}

}  // namespace

Interruption::Interruption() {
  const sigset_t signals = watched_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  watcher_ = std::jthread([this] { watch(); });
}

Interruption::~Interruption() {
  closing_ = true;
  pthread_kill(watcher_.native_handle(), kWake);
  watcher_.join();
  const sigset_t signals = watched_signals();
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
}

void Interruption::watch() {
  const sigset_t signals = watched_signals();
  while (!closing_) {
    int number = 0;
    if (sigwait(&signals, &number) != 0 || number == kWake) continue;
    if (requested_) std::_Exit(static_cast<int>(ExitCode::kCancelled));
    const std::lock_guard lock(mutex_);
    requested_ = true;
    changed_.notify_all();
    if (action_) action_();
  }
}

bool Interruption::wait(std::chrono::milliseconds time) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, time, [this] { return requested_.load(); });
}

void Interruption::set_action(std::function<void()> action) {
  const std::lock_guard lock(mutex_);
  action_ = std::move(action);
}

void Interruption::check() const {
  if (requested_) throw Failure(code::kInterrupted, "interrupted");
}

}  // namespace crease::client
