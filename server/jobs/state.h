#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace creased {

enum class JobState { kQueued, kRunning, kSucceeded, kFailed, kCancelled };

inline constexpr std::array kJobStates = {JobState::kQueued, JobState::kRunning, JobState::kSucceeded,
                                          JobState::kFailed, JobState::kCancelled};

/// The name of a state in the API and in the database.
constexpr std::string_view name_of(JobState state) {
  constexpr std::array<std::string_view, kJobStates.size()> kNames = {"queued", "running", "succeeded", "failed",
                                                                      "cancelled"};
  return kNames.at(static_cast<std::size_t>(state));
}

/// The state with this name; nullopt when there is none.
constexpr std::optional<JobState> job_state(std::string_view name) {
  for (const JobState state : kJobStates) {
    if (name_of(state) == name) return state;
  }
  return std::nullopt;
}

/// Whether a job in this state can no longer change.
constexpr bool is_terminal(JobState state) { return state != JobState::kQueued && state != JobState::kRunning; }
constexpr bool is_terminal(std::string_view name) {
  const auto state = job_state(name);
  return state && is_terminal(*state);
}

}  // namespace creased
