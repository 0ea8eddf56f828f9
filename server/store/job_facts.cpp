#include "server/store/job_facts.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <charconv>
#include <chrono>
#include <ctime>
#include <limits>

#include "proto/error_table.h"
#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;
namespace v1 = crease::v1;
namespace {

constexpr std::size_t kCursorDigits = 16;

bool parse(google::protobuf::MessageLite& message, const std::string& bytes) { return message.ParseFromString(bytes); }

v1::Progress queued_progress(const v1::Progress& former) {
  v1::Progress progress;
  progress.set_stage("queued");
  progress.set_sweeps(former.sweeps());
  return progress;
}

v1::Progress finished_progress(v1::Progress progress) {
  progress.set_stage("done");
  progress.set_fraction(1);
  progress.set_eta_seconds(0);
  return progress;
}

}  // namespace

std::int64_t now_ms() {
  using namespace std::chrono;
  return duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
}

std::string timestamp(std::int64_t ms) {
  constexpr std::int64_t kMsPerSecond = 1000;
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(static_cast<std::time_t>(ms / kMsPerSecond)),
                     ms % kMsPerSecond);
}

v1::Job job_of(const JobRecord& record) {
  v1::Job job;
  bool whole = parse(job, record.warnings);  // only its warnings are set
  job.set_id(record.id);
  job.set_state(record.state);
  job.set_created_at(timestamp(record.created));
  if (record.started) job.set_started_at(timestamp(*record.started));
  if (record.finished) job.set_finished_at(timestamp(*record.finished));
  job.set_attempt(static_cast<std::uint32_t>(record.attempt));
  whole = parse(*job.mutable_input(), record.input) && whole;
  whole = parse(*job.mutable_parameters(), record.parameters) && whole;
  whole = parse(*job.mutable_progress(), record.progress) && whole;
  if (record.expires) job.set_expires_at(timestamp(*record.expires));
  if (record.result) whole = parse(*job.mutable_result(), *record.result) && whole;
  if (record.error) whole = parse(*job.mutable_error(), *record.error) && whole;
  if (whole) return job;
  job.set_state(std::string(name_of(JobState::kFailed)));
  *job.mutable_error() =
      crease::to_problem(crease::Error(code::kStoreUnavailable, "the row of this job in the database is damaged"));
  return job;
}

UploadGuard::~UploadGuard() {
  std::error_code ignored;
  std::filesystem::remove(job.upload, ignored);
  std::filesystem::remove(job.weights, ignored);
}

v1::Progress first_progress(const v1::Parameters& parameters) {
  v1::Progress progress;
  progress.set_stage("queued");
  progress.set_sweeps(parameters.sweeps());
  return progress;
}

std::string progress_after(const std::string& progress, JobState state) {
  v1::Progress former;
  former.ParseFromString(progress);
  if (state == JobState::kQueued) return queued_progress(former).SerializeAsString();
  if (state == JobState::kSucceeded) return finished_progress(former).SerializeAsString();
  return progress;
}

std::int64_t retention_ms(const v1::Parameters& parameters) {
  constexpr double kMsPerHour = 3'600'000;
  return static_cast<std::int64_t>(parameters.retention_hours() * kMsPerHour);
}

std::string warnings_bytes(const google::protobuf::RepeatedPtrField<v1::Warning>& warnings) {
  v1::Job carrier;
  *carrier.mutable_warnings() = warnings;
  return carrier.SerializeAsString();
}

std::string megabytes(std::uint64_t bytes) {
  constexpr double kMegabyte = 1U << 20U;
  return fmt::format("{:.1f} MiB", static_cast<double>(bytes) / kMegabyte);
}

void check_limits(const Usage& all, const Usage& own, const StoreOptions& limits, const OwnerLimits& own_limits,
                  std::uint64_t bytes) {
  if (all.queued >= limits.max_queued) {
    throw crease::Error(code::kQueueFull,
                        fmt::format("{} jobs are queued, the most that this service allows", limits.max_queued));
  }
  if (own_limits.max_queued > 0 && own.queued >= own_limits.max_queued) {
    throw crease::Error(code::kKeyQueueFull,
                        fmt::format("{} jobs are queued, the most that this key may have", own_limits.max_queued));
  }
  const auto check_quota = [&](std::uint64_t used, std::uint64_t quota, std::string_view whose) {
    if (quota == 0 || used + bytes <= quota) return;
    throw crease::Error(code::kQuotaExceeded,
                        fmt::format("the job may need {}, but {} of the {} that {} may use are taken; delete jobs or "
                                    "wait until results expire",
                                    megabytes(bytes), megabytes(used), megabytes(quota), whose));
  };
  check_quota(own.bytes, own_limits.max_bytes, "this key");
  check_quota(all.bytes, limits.quota_bytes, "this service");
}

void throw_conflict(const std::string& job_id) {
  throw crease::Error(code::kIdempotencyConflict,
                      fmt::format("the key was already used for a different request, which created job {}", job_id));
}

std::string cursor_after(std::int64_t seq) { return fmt::format("{:016x}", seq); }

std::int64_t parse_cursor(std::string_view cursor) {
  if (cursor.empty()) return std::numeric_limits<std::int64_t>::max();
  std::int64_t seq = 0;
  const auto [end, failure] = std::from_chars(cursor.data(), cursor.data() + cursor.size(), seq, 16);
  if (failure != std::errc() || end != cursor.data() + cursor.size() || cursor.size() != kCursorDigits || seq < 1) {
    throw crease::Error::parameter(code::kParameterInvalid, "cursor", std::string(cursor),
                                   "the next_cursor of an earlier page");
  }
  return seq;
}

void check_state(std::string_view state) {
  if (state.empty() || job_state(state)) return;
  std::vector<std::string_view> names;
  for (const JobState known : kJobStates) names.push_back(name_of(known));
  throw crease::Error::parameter(code::kParameterInvalid, "state", std::string(state),
                                 fmt::format("one of {}", fmt::join(names, ", ")));
}

void log_step(const std::string& id, const Transition& step) {
  if (step.error) return spdlog::error("job {} failed: {}", id, step.error->detail());
  if (step.life.state != JobState::kQueued || step.life.losses.empty()) return;
  spdlog::warn("job {} queued again: {}", id, step.life.losses);
}

}  // namespace creased
