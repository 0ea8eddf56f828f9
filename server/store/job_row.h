#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "crease/v1/job.pb.h"
#include "server/jobs/life.h"
#include "server/store/job_facts.h"
#include "server/store/sqlite_connection.h"

namespace creased {

/// "SELECT … FROM jobs " and `rest`, with the columns that `read_job` needs.
std::string select_jobs(std::string_view rest);

/// The job of a row of `select_jobs`.
crease::v1::Job read_job(const Query& row);
/// The position of the job in the order of submission.
std::int64_t job_seq(const Query& row);

/// The job with this id, if `owner` may see it.
std::optional<crease::v1::Job> job_of_id(Connection& connection, std::string_view id,
                                         const std::optional<std::string>& owner = std::nullopt);

/// The columns that `read_life` needs.
std::string_view life_columns();
inline constexpr int kLifeColumns = 7;
Life read_life(const Query& row, int first_column);

/// What an owner, or all together, has in the store.
Usage usage_of(Connection& connection, const std::optional<std::string>& owner);

/// Increments the version counter. Every transaction that changes a job does this first.
void count_change(Connection& connection);

[[noreturn]] void throw_store_unavailable(const SQLite::Exception& exception);

/// Runs `work` and turns errors of SQLite into Error store_unavailable.
template <class Work>
auto with_store_errors(Work&& work) -> decltype(work()) {
  try {
    return work();
  } catch (const SQLite::Exception& exception) {
    throw_store_unavailable(exception);
  }
}

}  // namespace creased
