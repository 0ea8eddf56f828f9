#include "server/store/job_row.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sqlite3.h>

#include <chrono>
#include <ctime>

#include "server/store/failure.h"

namespace creased {
namespace {

namespace v1 = crease::v1;

void parse(google::protobuf::MessageLite& message, const std::string& bytes) {
  if (!message.ParseFromString(bytes)) throw crease::Error(code::kStoreUnavailable, "a row of the database is damaged");
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

std::string select_jobs(std::string_view rest) {
  return fmt::format(
      "SELECT id, state, created, started, finished, attempt, input, parameters, warnings, progress, result, error, "
      "seq, expires"
      " FROM jobs {}",
      rest);
}

v1::Job read_job(const Query& row) {
  v1::Job job;
  parse(job, row.text(8));  // only its warnings are set
  job.set_id(row.text(0));
  job.set_state(row.text(1));
  job.set_created_at(timestamp(row.integer(2)));
  if (const auto started = row.optional_integer(3)) job.set_started_at(timestamp(*started));
  if (const auto finished = row.optional_integer(4)) job.set_finished_at(timestamp(*finished));
  job.set_attempt(static_cast<std::uint32_t>(row.integer(5)));
  parse(*job.mutable_input(), row.text(6));
  parse(*job.mutable_parameters(), row.text(7));
  parse(*job.mutable_progress(), row.text(9));
  if (const auto expires = row.optional_integer(13)) job.set_expires_at(timestamp(*expires));
  if (!row.is_null(10)) parse(*job.mutable_result(), row.text(10));
  if (!row.is_null(11)) parse(*job.mutable_error(), row.text(11));
  return job;
}

std::int64_t job_seq(const Query& row) { return row.integer(12); }

std::string warnings_bytes(const google::protobuf::RepeatedPtrField<v1::Warning>& warnings) {
  v1::Job carrier;
  *carrier.mutable_warnings() = warnings;
  return carrier.SerializeAsString();
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
