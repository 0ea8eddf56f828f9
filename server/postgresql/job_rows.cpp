#include "server/postgresql/job_rows.h"

#include <fmt/format.h>

namespace creased {
namespace {

constexpr int kSeqColumn = 13;

std::optional<std::int64_t> number_or_null(const pqxx::field& field) {
  return field.is_null() ? std::nullopt : std::optional<std::int64_t>(field.as<std::int64_t>());
}

std::optional<std::string> bytes_or_null(const pqxx::field& field) {
  return field.is_null() ? std::nullopt : std::optional<std::string>(bytes_of(field));
}

}  // namespace

std::string select_jobs_with(std::string_view rest) {
  return fmt::format(
      "SELECT id, state, created, attempt, started, finished, expires, input, parameters, warnings, progress, result,"
      " error, seq FROM jobs {}",
      rest);
}

crease::v1::Job job_in(const pqxx::row& row) {
  return job_of({.id = row[0].as<std::string>(),
                 .state = row[1].as<std::string>(),
                 .created = row[2].as<std::int64_t>(),
                 .attempt = row[3].as<std::int64_t>(),
                 .started = number_or_null(row[4]),
                 .finished = number_or_null(row[5]),
                 .expires = number_or_null(row[6]),
                 .input = bytes_of(row[7]),
                 .parameters = bytes_of(row[8]),
                 .warnings = bytes_of(row[9]),
                 .progress = bytes_of(row[10]),
                 .result = bytes_or_null(row[11]),
                 .error = bytes_or_null(row[12])});
}

std::int64_t seq_in(const pqxx::row& row) { return row[kSeqColumn].as<std::int64_t>(); }

std::optional<crease::v1::Job> job_with_id(Transaction& transaction, std::string_view id, const Owner& owner) {
  static const std::string sql = select_jobs_with("WHERE id = $1 AND ($2::text IS NULL OR owner = $2)");
  const auto rows = transaction.run(sql, id, owner);
  return rows.empty() ? std::nullopt : std::optional<crease::v1::Job>(job_in(rows[0]));
}

std::string_view columns_of_life() {
  return "state, attempt, strikes, deferrals, progressed, cancel_requested, losses";
}

Life life_in(const pqxx::row& row) {
  Life life;
  life.state = job_state(row[0].as<std::string>()).value_or(JobState::kFailed);
  life.attempt = row[1].as<std::uint32_t>();
  life.strikes = row[2].as<std::uint32_t>();
  life.deferrals = row[3].as<std::uint32_t>();
  life.progressed = row[4].as<bool>();
  life.cancel_requested = row[5].as<bool>();
  life.losses = row[6].as<std::string>();
  return life;
}

Usage usage_in(Transaction& transaction, const Owner& owner) {
  const auto row = transaction.run(
      "SELECT coalesce(sum(queued), 0), coalesce(sum(bytes), 0) FROM usage WHERE $1::text IS NULL OR owner = $1",
      owner)[0];
  return {row[0].as<std::size_t>(), row[1].as<std::uint64_t>()};
}

}  // namespace creased
