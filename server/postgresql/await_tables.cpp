#include "server/postgresql/await_tables.h"

#include <fmt/format.h>
#include <libpq-fe.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <pqxx/pqxx>
#include <thread>

#include "core/base/stopwatch.h"
#include "server/base/failure.h"
#include "server/postgresql/schema.h"
#include "server/postgresql/session.h"

namespace creased {
namespace code = crease::code;
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kFirstPauseOfStart{50}, kLongestPauseOfStart{2'000};
constexpr std::chrono::minutes kBetweenLines{1};

/// While it lives, SIGTERM and SIGINT end the process.
class EndsAtOnce {
 public:
  EndsAtOnce() {
    struct sigaction end {};
    end.sa_handler = [](int) { ::_exit(0); };
    sigset_t signals;
    sigemptyset(&signals);
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      ::sigaction(kSignals.at(i), &end, &former_.at(i));
      sigaddset(&signals, kSignals.at(i));
    }
    ::pthread_sigmask(SIG_UNBLOCK, &signals, &former_mask_);
  }
  ~EndsAtOnce() {
    ::pthread_sigmask(SIG_SETMASK, &former_mask_, nullptr);
    for (std::size_t i = 0; i < kSignals.size(); ++i) ::sigaction(kSignals.at(i), &former_.at(i), nullptr);
  }
  EndsAtOnce(const EndsAtOnce&) = delete;
  EndsAtOnce& operator=(const EndsAtOnce&) = delete;

 private:
  static constexpr std::array kSignals = {SIGTERM, SIGINT};
  std::array<struct sigaction, kSignals.size()> former_{};
  sigset_t former_mask_{};
};

/// Pauses between the tries, each longer than the one before, and tells of them now and then.
class Wait {
 public:
  void pause(std::string_view reason) {
    if (Clock::now() >= next_line_) {
      spdlog::warn("waiting for the database: {}", reason);
      next_line_ = Clock::now() + kBetweenLines;
    }
    std::this_thread::sleep_for(pause_);
    pause_ = std::min(pause_ * 2, kLongestPauseOfStart);
  }
  void end() const {
    if (next_line_ > Clock::time_point()) spdlog::info("the database answers after {:.3f} s", stopwatch_.seconds());
  }

 private:
  crease::Stopwatch stopwatch_;
  milliseconds pause_ = kFirstPauseOfStart;
  Clock::time_point next_line_;
};

/// Throws the error that a failure stands for, unless the server may answer later.
/// \pre called in a handler of the failure
void throw_what_lasts(const std::string& url, const pqxx::pqxx_exception& failure) {
  const PGPing answer = ::PQping(url.c_str());
  if (answer == PQPING_NO_RESPONSE || answer == PQPING_REJECT) return;
  if (dynamic_cast<const pqxx::broken_connection*>(&failure) == nullptr) throw_as_store_error(failure);
  try {
    // Where a primary is asked for, there may be none yet. Otherwise the server has come in between.
    const pqxx::connection any(url + "&target_session_attrs=any");
  } catch (const pqxx::broken_connection& refusal) {
    throw crease::Error(code::kStoreUnavailable,
                        fmt::format("the database cannot be used: {}", first_line(refusal.what())));
  }
}

}  // namespace

void await_tables(const std::string& url) {
  const EndsAtOnce on_signals;
  Wait wait;
  for (;;) {
    try {
      Session session(url);
      prepare_tables(session.connection());
      return wait.end();
    } catch (const pqxx::pqxx_exception& failure) {
      throw_what_lasts(url, failure);
      wait.pause(first_line(failure.base().what()));
    }
  }
}

}  // namespace creased
