#include "server/jobs/life.h"

#include <fmt/format.h>

#include <algorithm>

#include "proto/error_table.h"

namespace creased {
namespace {

/// A lost attempt counts four points; one that was lost with its server counts one. So a job that crashes the whole
/// server still fails in the end, but ordinary restarts do not make it fail.
constexpr std::uint32_t kStrikesOfAttempt = 4;
constexpr std::uint32_t kMostAttempts = 100, kMostDeferrals = 100;
constexpr std::chrono::milliseconds kFirstWait{1'000};
constexpr char kLossEnd = ';';

std::chrono::milliseconds wait_after(std::uint32_t deferrals) {
  constexpr std::uint32_t kDoublings = 9;
  return std::min(kLongestDeferral, kFirstWait * (1U << std::min(deferrals - 1, kDoublings)));
}

Transition queued_again(Life life, std::chrono::milliseconds wait) {
  life.state = life.cancel_requested ? JobState::kCancelled : JobState::kQueued;
  if (is_terminal(life.state)) wait = {};
  return {std::move(life), wait};
}

Transition failed(Life life, crease::ErrorCode error_code, const std::string& detail) {
  life.state = life.cancel_requested ? JobState::kCancelled : JobState::kFailed;
  if (life.cancel_requested) return {std::move(life)};
  return {std::move(life), {}, crease::to_problem(crease::Error(error_code, detail))};
}

}  // namespace

Life claimed(Life life) {
  life.state = JobState::kRunning;
  ++life.attempt;
  life.progressed = false;
  return life;
}

Life progressed(Life life) {
  life.progressed = true;
  life.deferrals = 0;
  return life;
}

Life cancelled(Life life) {
  if (life.state == JobState::kQueued) life.state = JobState::kCancelled;
  if (life.state == JobState::kRunning) life.cancel_requested = true;
  return life;
}

Life ended(Life life, JobState state) {
  life.state = state;
  return life;
}

Transition put_back(Life life) {
  if (!life.cancel_requested) --life.attempt;
  return queued_again(std::move(life), {});
}

Transition deferred(Life life, const crease::Error& reason) {
  ++life.deferrals;
  if (life.deferrals >= kMostDeferrals) {
    return failed(
        std::move(life), reason.code(),
        fmt::format("the store could not keep the job, {} times in a row: {}", kMostDeferrals, reason.detail()));
  }
  if (!life.cancel_requested) --life.attempt;
  const auto wait = wait_after(life.deferrals);
  return queued_again(std::move(life), wait);
}

Transition lost(Life life, const Loss& loss, std::uint32_t max_attempts) {
  const std::string what = fmt::format("attempt {} {}", life.attempt, loss.what);
  const std::uint32_t strikes = loss.with_server ? 1 : kStrikesOfAttempt;
  const bool count_anew = (life.progressed && !loss.by_limit) || life.strikes == 0;
  life.losses = count_anew ? what : fmt::format("{}{} {}", life.losses, kLossEnd, what);
  life.strikes = count_anew ? strikes : life.strikes + strikes;
  if (life.strikes < max_attempts * kStrikesOfAttempt && life.attempt < kMostAttempts) {
    return queued_again(std::move(life), {});
  }
  const auto attempts = 1 + std::ranges::count(life.losses, kLossEnd);
  const std::string detail = fmt::format("{} attempts in a row were lost: {}", attempts, life.losses);
  return failed(std::move(life), loss.code, detail);
}

}  // namespace creased
