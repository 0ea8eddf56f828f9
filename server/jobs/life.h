#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "core/error.h"
#include "crease/v1/job.pb.h"
#include "server/jobs/state.h"

namespace creased {

/// Why an attempt of a job was lost.
struct Loss {
  std::string what;                                    ///< for example "was killed by signal 11 (SIGSEGV)"
  crease::ErrorCode code = crease::code::kWorkerLost;  ///< error code if this was the last attempt
  /// The whole service ended. The job is rarely the cause, so this counts as a quarter of an attempt.
  bool with_server = false;
  /// Exceeded a limit of memory, time or files, as the next attempt would. Progress does not reset the count.
  bool by_limit = false;
};

/// What a job has been through, as far as it decides what becomes of it.
struct Life {
  JobState state = JobState::kQueued;
  std::uint32_t attempt = 0;    ///< attempts begun, without those that were put back
  std::uint32_t strikes = 0;    ///< quarters of attempts lost in a row
  std::uint32_t deferrals = 0;  ///< attempts in a row that the store could not keep
  bool progressed = false;      ///< this attempt has written a checkpoint
  bool cancel_requested = false;
  std::string losses = {};  ///< what happened to each of the lost attempts in a row

  bool operator==(const Life&) const = default;
};

/// A step in the life of a job, and what the step asks of the queue.
struct Transition {
  Life life;
  std::chrono::milliseconds wait{0};              ///< before a queued job may be claimed again, so that others pass it
  std::optional<crease::v1::Problem> error = {};  ///< of a job that has failed
};

// The transitions. A job whose cancellation was requested is cancelled wherever it would be queued again.

/// A worker begins an attempt.
Life claimed(Life life);

/// The attempt has written a checkpoint: earlier lost attempts no longer count.
Life progressed(Life life);

/// The caller cancels. A queued job ends; a running one is asked to end; an ended one stays as it is.
Life cancelled(Life life);

/// The attempt ended as `state` says. \pre is_terminal(state)
Life ended(Life life, JobState state);

/// The worker stops and gives the job back. That costs nothing.
Transition put_back(Life life);

/// The store could not keep what the attempt needed or made. That costs no attempt, but the job waits, from a second up
/// to five minutes, and fails with `reason` when it happens for the hundredth time in a row (after more than 7 hours).
Transition deferred(Life life, const crease::Error& reason);

/// The attempt was lost. The job fails after `max_attempts` in a row without progress, with a description of each, and
/// after a hundred attempts in any case.
Transition lost(Life life, const Loss& loss, std::uint32_t max_attempts);

/// The longest time that a transition makes a job wait.
inline constexpr std::chrono::milliseconds kLongestDeferral{300'000};

}  // namespace creased
