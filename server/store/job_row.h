#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "crease/v1/job.pb.h"
#include "server/store/sqlite_connection.h"

namespace creased {

/// Milliseconds since 1970.
std::int64_t now_ms();

/// Milliseconds since 1970 in RFC 3339 form, in UTC with milliseconds.
std::string timestamp(std::int64_t ms);

/// "SELECT … FROM jobs " and `rest`, with the columns that `read_job` needs.
std::string select_jobs(std::string_view rest);

/// The job of a row of `select_jobs`. \throw Error store_unavailable when the row is damaged
crease::v1::Job read_job(const Query& row);
/// The position of the job in the order of submission.
std::int64_t job_seq(const Query& row);

/// Warnings as they are stored in the database.
std::string warnings_bytes(const google::protobuf::RepeatedPtrField<crease::v1::Warning>& warnings);

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
