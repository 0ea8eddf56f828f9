#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "proto/error_table.h"
#include "server/store/failure.h"
#include "server/store/job_row.h"
#include "server/store/sqlite_store.h"

namespace creased {
namespace v1 = crease::v1;
namespace {

// ?1: now.
constexpr std::string_view kOldestClaimable =
    "SELECT min(seq) FROM ("
    "SELECT min(seq) AS seq FROM jobs WHERE state = 'queued'"
    " UNION ALL "
    "SELECT min(seq) FROM jobs WHERE state = 'running' AND lease_until <= ?1)";

std::optional<std::int64_t> oldest_claimable(Connection& connection, std::int64_t now) {
  Query row(connection, kOldestClaimable, now);
  row.next();
  return row.optional_integer(0);
}

Store::Hold read_hold(Query& row) {
  if (!row.next()) return Store::Hold::kLost;
  return row.integer(0) != 0 ? Store::Hold::kCancelRequested : Store::Hold::kHeld;
}

void cancel_abandoned(Connection& connection, std::int64_t now) {
  Query(connection,
        "UPDATE jobs SET state = 'cancelled', finished = ?1, lease_owner = NULL,"
        " version = (SELECT version FROM change_counter)"
        " WHERE state = 'running' AND lease_until <= ?1 AND cancel_requested = 1",
        now)
      .run();
}

std::string worker_lost_error(std::uint32_t attempt) {
  return crease::to_problem(
             crease::Error(
                 code::kWorkerLost,
                 fmt::format("in each of {} attempts the worker process died or was lost before the job ended",
                             attempt)))
      .SerializeAsString();
}

std::vector<Claim> exhausted_claims(Connection& connection, std::int64_t now, std::uint32_t max_attempts) {
  Query rows(connection,
             "SELECT id, lease_owner, attempt FROM jobs"
             " WHERE state = 'running' AND lease_until <= ? AND attempt >= ?",
             now, max_attempts);
  std::vector<Claim> claims;
  while (rows.next()) claims.push_back({rows.text(0), rows.text(1), static_cast<std::uint32_t>(rows.integer(2))});
  return claims;
}

void fail_exhausted(Connection& connection, std::int64_t now, std::uint32_t max_attempts) {
  for (const Claim& lost : exhausted_claims(connection, now, max_attempts)) {
    const std::string error = worker_lost_error(lost.attempt);
    Query(connection,
          "UPDATE jobs SET state = 'failed', finished = ?, error = ?, lease_owner = NULL,"
          " version = (SELECT version FROM change_counter) WHERE id = ?",
          now, Blob{error}, lost.job_id)
        .run();
    spdlog::error("job {} failed: worker_lost, attempt {} by {}", lost.job_id, lost.attempt, lost.owner);
  }
}

std::optional<Claim> claim_row(Connection& connection, std::int64_t seq, std::string_view owner, std::int64_t now,
                               std::int64_t lease_until) {
  Query row(connection,
            "UPDATE jobs SET state = 'running', started = ?, attempt = attempt + 1, lease_owner = ?, lease_until = ?,"
            " version = (SELECT version FROM change_counter) WHERE seq = ? RETURNING id, attempt",
            now, owner, lease_until, seq);
  row.next();
  return Claim{row.text(0), std::string(owner), static_cast<std::uint32_t>(row.integer(1))};
}

/// The job of a claim while it holds, inside a transaction.
std::optional<v1::Job> held_job(Connection& connection, const Claim& claim) {
  static const std::string sql = select_jobs("WHERE id = ? AND lease_owner = ? AND attempt = ? AND state = 'running'");
  Query row(connection, sql, claim.job_id, claim.owner, claim.attempt);
  if (!row.next()) return std::nullopt;
  return read_job(row);
}

v1::Progress finished_progress(v1::Progress progress) {
  progress.set_stage("done");
  progress.set_fraction(1);
  progress.set_eta_seconds(0);
  return progress;
}

v1::Progress queued_progress(const v1::Progress& former) {
  v1::Progress progress;
  progress.set_stage("queued");
  progress.set_sweeps(former.sweeps());
  return progress;
}

bool same_warning(const v1::Warning& a, const v1::Warning& b) {
  return a.code() == b.code() && a.detail() == b.detail();
}

void add_warnings(v1::Job& job, const std::vector<v1::Warning>& more) {
  for (const auto& warning : more) {
    const bool known = std::ranges::any_of(job.warnings(), [&](const auto& old) { return same_warning(old, warning); });
    if (!known) *job.add_warnings() = warning;
  }
}

}  // namespace

std::optional<Claim> SqliteStore::claim(std::string_view owner, std::chrono::milliseconds lease) {
  return with_store_errors([&]() -> std::optional<Claim> {
    const std::int64_t now = now_ms();
    {
      // Idle workers look often: that must not take the write lock.
      ReaderPool::Loan reader(readers_);
      if (!oldest_claimable(*reader, now)) return std::nullopt;
    }
    Writer::Transaction transaction(writer_);
    count_change(*transaction);
    cancel_abandoned(*transaction, now);
    fail_exhausted(*transaction, now, max_attempts_);
    std::optional<Claim> claim;
    if (const auto seq = oldest_claimable(*transaction, now)) {
      claim = claim_row(*transaction, *seq, owner, now, now + lease.count());
    }
    transaction.commit();
    return claim;
  });
}

Store::Hold SqliteStore::check(const Claim& claim) {
  return with_store_errors([&] {
    ReaderPool::Loan reader(readers_);
    Query row(*reader,
              "SELECT cancel_requested FROM jobs"
              " WHERE id = ? AND lease_owner = ? AND attempt = ? AND state = 'running'",
              claim.job_id, claim.owner, claim.attempt);
    return read_hold(row);
  });
}

Store::Hold SqliteStore::renew(const Claim& claim, std::chrono::milliseconds lease) {
  return with_store_errors([&] {
    Writer::Transaction transaction(writer_);
    Hold hold = Hold::kLost;
    {
      Query row(*transaction,
                "UPDATE jobs SET lease_until = ? WHERE id = ? AND lease_owner = ? AND attempt = ? AND state = 'running'"
                " RETURNING cancel_requested",
                now_ms() + lease.count(), claim.job_id, claim.owner, claim.attempt);
      hold = read_hold(row);
    }
    transaction.commit();
    return hold;
  });
}

void SqliteStore::publish_progress(const Claim& claim, const v1::Progress& progress) {
  with_store_errors([&] {
    const std::string bytes = progress.SerializeAsString();
    Writer::Transaction transaction(writer_);
    count_change(*transaction);
    Query(*transaction,
          "UPDATE jobs SET progress = ?, version = (SELECT version FROM change_counter)"
          " WHERE id = ? AND lease_owner = ? AND attempt = ? AND state = 'running'",
          Blob{bytes}, claim.job_id, claim.owner, claim.attempt)
        .run();
    transaction.commit();
  });
}

bool SqliteStore::succeed(const Claim& claim, const v1::ResultFacts& result, const std::vector<v1::Warning>& warnings) {
  return with_store_errors([&] {
    Writer::Transaction transaction(durable_writer_);
    auto job = held_job(*transaction, claim);
    if (!job) return false;
    add_warnings(*job, warnings);
    const std::string all_warnings = warnings_bytes(job->warnings()), result_bytes = result.SerializeAsString(),
                      progress = finished_progress(job->progress()).SerializeAsString();
    count_change(*transaction);
    Query(*transaction,
          "UPDATE jobs SET state = 'succeeded', finished = ?, result = ?, warnings = ?, progress = ?,"
          " lease_owner = NULL, version = (SELECT version FROM change_counter) WHERE id = ?",
          now_ms(), Blob{result_bytes}, Blob{all_warnings}, Blob{progress}, claim.job_id)
        .run();
    transaction.commit();
    return true;
  });
}

bool SqliteStore::fail(const Claim& claim, const v1::Problem& problem) {
  return with_store_errors([&] {
    const std::string error = problem.SerializeAsString();
    Writer::Transaction transaction(durable_writer_);
    count_change(*transaction);
    const int rows = Query(*transaction,
                           "UPDATE jobs SET state = 'failed', finished = ?, error = ?, lease_owner = NULL,"
                           " version = (SELECT version FROM change_counter)"
                           " WHERE id = ? AND lease_owner = ? AND attempt = ? AND state = 'running'",
                           now_ms(), Blob{error}, claim.job_id, claim.owner, claim.attempt)
                         .run();
    transaction.commit();
    return rows > 0;
  });
}

bool SqliteStore::finish_cancelled(const Claim& claim) {
  return with_store_errors([&] {
    Writer::Transaction transaction(durable_writer_);
    count_change(*transaction);
    const int rows = Query(*transaction,
                           "UPDATE jobs SET state = 'cancelled', finished = ?, lease_owner = NULL,"
                           " version = (SELECT version FROM change_counter)"
                           " WHERE id = ? AND lease_owner = ? AND attempt = ? AND state = 'running'",
                           now_ms(), claim.job_id, claim.owner, claim.attempt)
                         .run();
    transaction.commit();
    return rows > 0;
  });
}

bool SqliteStore::put_back(const Claim& claim) {
  return with_store_errors([&] {
    Writer::Transaction transaction(durable_writer_);
    const auto job = held_job(*transaction, claim);
    if (!job) return false;
    const std::string progress = queued_progress(job->progress()).SerializeAsString();
    count_change(*transaction);
    Query(*transaction,
          "UPDATE jobs SET state = iif(cancel_requested, 'cancelled', 'queued'),"
          " finished = iif(cancel_requested, ?1, NULL), started = iif(cancel_requested, started, NULL),"
          " attempt = attempt - iif(cancel_requested, 0, 1), progress = iif(cancel_requested, progress, ?2),"
          " lease_owner = NULL,"
          " version = (SELECT version FROM change_counter) WHERE id = ?3",
          now_ms(), Blob{progress}, claim.job_id)
        .run();
    transaction.commit();
    return true;
  });
}

}  // namespace creased
