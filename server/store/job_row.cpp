#include "server/store/job_row.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sqlite3.h>

#include <chrono>
#include <ctime>

#include "proto/error_table.h"
#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;
namespace {

namespace v1 = crease::v1;

bool parse(google::protobuf::MessageLite& message, const std::string& bytes) { return message.ParseFromString(bytes); }

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

std::string select_jobs(std::string_view rest) {
  return fmt::format(
      "SELECT id, state, created, started, finished, attempt, input, parameters, warnings, progress, result, error, "
      "seq, expires"
      " FROM jobs {}",
      rest);
}

v1::Job read_job(const Query& row) {
  v1::Job job;
  bool whole = parse(job, row.text(8));  // only its warnings are set
  job.set_id(row.text(0));
  job.set_state(row.text(1));
  job.set_created_at(timestamp(row.integer(2)));
  if (const auto started = row.optional_integer(3)) job.set_started_at(timestamp(*started));
  if (const auto finished = row.optional_integer(4)) job.set_finished_at(timestamp(*finished));
  job.set_attempt(static_cast<std::uint32_t>(row.integer(5)));
  whole = parse(*job.mutable_input(), row.text(6)) && whole;
  whole = parse(*job.mutable_parameters(), row.text(7)) && whole;
  whole = parse(*job.mutable_progress(), row.text(9)) && whole;
  if (const auto expires = row.optional_integer(13)) job.set_expires_at(timestamp(*expires));
  if (!row.is_null(10)) whole = parse(*job.mutable_result(), row.text(10)) && whole;
  if (!row.is_null(11)) whole = parse(*job.mutable_error(), row.text(11)) && whole;
  if (whole) return job;
  job.set_state(std::string(name_of(JobState::kFailed)));
  *job.mutable_error() =
      crease::to_problem(crease::Error(code::kStoreUnavailable, "the row of this job in the database is damaged"));
  return job;
}

std::optional<v1::Job> job_of_id(Connection& connection, std::string_view id, const std::optional<std::string>& owner) {
  static const std::string sql = select_jobs("WHERE id = ?1 AND (?2 IS NULL OR owner = ?2)");
  Query row(connection, sql, id, owner);
  if (!row.next()) return std::nullopt;
  return read_job(row);
}

std::string_view life_columns() { return "state, attempt, strikes, deferrals, progressed, cancel_requested, losses"; }

Life read_life(const Query& row, int first_column) {
  const auto count = [&](int column) { return static_cast<std::uint32_t>(row.integer(first_column + column)); };
  Life life;
  life.state = job_state(row.text(first_column)).value_or(JobState::kFailed);
  life.attempt = count(1);
  life.strikes = count(2);
  life.deferrals = count(3);
  life.progressed = count(4) != 0;
  life.cancel_requested = count(5) != 0;
  life.losses = row.text(first_column + 6);
  return life;
}

Usage usage_of(Connection& connection, const std::optional<std::string>& owner) {
  Query row(connection,
            "SELECT coalesce(sum(queued), 0), coalesce(sum(bytes), 0) FROM usage WHERE ?1 IS NULL OR owner = ?1",
            owner);
  row.next();
  return {static_cast<std::size_t>(row.integer(0)), static_cast<std::uint64_t>(row.integer(1))};
}

std::int64_t job_seq(const Query& row) { return row.integer(12); }

std::string warnings_bytes(const google::protobuf::RepeatedPtrField<v1::Warning>& warnings) {
  v1::Job carrier;
  *carrier.mutable_warnings() = warnings;
  return carrier.SerializeAsString();
}

std::string megabytes(std::uint64_t bytes) {
  constexpr double kMegabyte = 1U << 20U;
  return fmt::format("{:.1f} MiB", static_cast<double>(bytes) / kMegabyte);
}

void count_change(Connection& connection) {
  Query(connection, "UPDATE change_counter SET version = version + 1").run();
}

void throw_store_unavailable(const SQLite::Exception& exception) {
  const bool full = exception.getErrorCode() == SQLITE_FULL;
  throw crease::Error(full ? code::kStorageFull : code::kStoreUnavailable,
                      fmt::format("database error: {} ({})", exception.what(), exception.getErrorStr()));
}

}  // namespace creased
