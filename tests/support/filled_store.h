#pragma once

#include <cstdint>
#include <string>

namespace crease::test {

/// The two owners of the jobs of `fill_with_ended_jobs`. The first is that of a service without keys.
inline constexpr const char *kLuckyOwner = "", *kUnluckyOwner = "unlucky";

/// Adds `count` jobs that have ended to a shared store, with the facts and files of a job there that has succeeded. The
/// even ones are kLuckyOwner's and have succeeded, the odd ones kUnluckyOwner's and have failed. They expire in a day.
void fill_with_ended_jobs(const std::string& url, std::int64_t count);

/// The id of one of these jobs, counted from 1.
std::string id_of_ended_job(std::int64_t number);

/// How many rows of its tables a database has read so far, and how often it has rewritten a row of a table. Waits for
/// the end of all other sessions, which only then are counted.
std::int64_t rows_read(const std::string& url);
std::int64_t rows_rewritten(const std::string& url, const std::string& table);

}  // namespace crease::test
