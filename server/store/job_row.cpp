#include "server/store/job_row.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;
namespace v1 = crease::v1;

std::string select_jobs(std::string_view rest) {
  return fmt::format(
      "SELECT id, state, created, started, finished, attempt, input, parameters, warnings, progress, result, error, "
      "seq, expires"
      " FROM jobs {}",
      rest);
}

v1::Job read_job(const Query& row) {
  const auto optional_text = [&](int column) {
    return row.is_null(column) ? std::nullopt : std::optional<std::string>(row.text(column));
  };
  return job_of({.id = row.text(0),
                 .state = row.text(1),
                 .created = row.integer(2),
                 .attempt = row.integer(5),
                 .started = row.optional_integer(3),
                 .finished = row.optional_integer(4),
                 .expires = row.optional_integer(13),
                 .input = row.text(6),
                 .parameters = row.text(7),
                 .warnings = row.text(8),
                 .progress = row.text(9),
                 .result = optional_text(10),
                 .error = optional_text(11)});
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

void count_change(Connection& connection) {
  Query(connection, "UPDATE change_counter SET version = version + 1").run();
}

void throw_store_unavailable(const SQLite::Exception& exception) {
  const bool full = exception.getErrorCode() == SQLITE_FULL;
  throw crease::Error(full ? code::kStorageFull : code::kStoreUnavailable,
                      fmt::format("database error: {} ({})", exception.what(), exception.getErrorStr()));
}

}  // namespace creased
