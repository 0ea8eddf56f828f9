#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "crease/v1/job.pb.h"
#include "server/jobs/life.h"
#include "server/store/store.h"

namespace creased {

// What every store makes of a job, whatever database keeps it.

/// Milliseconds since 1970.
std::int64_t now_ms();

/// Milliseconds since 1970 in RFC 3339 form, in UTC with milliseconds.
std::string timestamp(std::int64_t ms);

/// A job as a database keeps it. Times are milliseconds since 1970, messages are protobuf.
struct JobRecord {
  std::string id, state;
  std::int64_t created = 0, attempt = 0;
  std::optional<std::int64_t> started, finished, expires;
  std::string input, parameters, warnings, progress;
  std::optional<std::string> result, error;
};

/// The job of a record. What cannot be read of a damaged record is left out, and the job has failed with
/// store_unavailable.
crease::v1::Job job_of(const JobRecord& record);

/// Warnings as a record has them.
std::string warnings_bytes(const google::protobuf::RepeatedPtrField<crease::v1::Warning>& warnings);

/// The progress of a job that was just submitted.
crease::v1::Progress first_progress(const crease::v1::Parameters& parameters);
/// The progress of a job that enters a state, both as a record has them.
std::string progress_after(const std::string& progress, JobState state);

std::int64_t retention_ms(const crease::v1::Parameters& parameters);

/// A number of bytes for people, such as "1.5 MiB".
std::string megabytes(std::uint64_t bytes);

/// Removes the files of a submission at its end, unless they were moved.
struct UploadGuard {
  const NewJob& job;
  ~UploadGuard();
};

/// What an owner, or all together, has in the store.
struct Usage {
  std::size_t queued = 0;
  std::uint64_t bytes = 0;
};

/// Refuses a job of `bytes` that is over a limit. \throw Error queue_full, key_queue_full, quota_exceeded
void check_limits(const Usage& all, const Usage& own, const StoreOptions& limits, const OwnerLimits& own_limits,
                  std::uint64_t bytes);

/// \throw Error idempotency_conflict: the key was used for the request of this job
[[noreturn]] void throw_conflict(const std::string& job_id);

// Pages of a list: a cursor is the place of the last job in the order of submission.
std::string cursor_after(std::int64_t seq);
/// \throw Error parameter_invalid
std::int64_t parse_cursor(std::string_view cursor);
/// \throw Error parameter_invalid for the name of no state; empty for all states
void check_state(std::string_view state);

void log_step(const std::string& id, const Transition& step);

}  // namespace creased
