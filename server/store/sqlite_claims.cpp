#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "proto/convert.h"
#include "proto/error_table.h"
#include "server/store/failure.h"
#include "server/store/job_row.h"
#include "server/store/sqlite_store.h"

namespace creased {
namespace v1 = crease::v1;
namespace {

// ?1 is the current time.
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

/// Points that a lost attempt counts; one that was lost with its server counts one point. So a job that crashes the
/// whole server still fails in the end, but ordinary restarts do not make it fail.
constexpr std::uint32_t kStrikesOfAttempt = 4;
constexpr char kLossEnd = ';';

/// What decides whether a job with a lost attempt is queued again.
struct LostAttempt {
  Claim claim;
  bool cancel_requested = false, progressed = false;
  std::uint32_t strikes = 0;
  std::string losses, progress;
};

// ?1 and ?2 belong to the condition.
std::vector<LostAttempt> lost_attempts(Connection& connection, std::string_view condition, std::string_view text,
                                       std::int64_t number) {
  Query rows(connection,
             fmt::format("SELECT id, lease_owner, attempt, cancel_requested, progressed, strikes, losses, progress"
                         " FROM jobs WHERE state = 'running' AND {}",
                         condition),
             text, number);
  std::vector<LostAttempt> lost;
  while (rows.next()) {
    lost.push_back({{rows.text(0), rows.text(1), static_cast<std::uint32_t>(rows.integer(2))},
                    rows.integer(3) != 0,
                    rows.integer(4) != 0,
                    static_cast<std::uint32_t>(rows.integer(5)),
                    rows.text(6),
                    rows.text(7)});
  }
  return lost;
}

v1::Progress queued_progress(const v1::Progress& former) {
  v1::Progress progress;
  progress.set_stage("queued");
  progress.set_sweeps(former.sweeps());
  return progress;
}

std::string queued_progress_bytes(const std::string& former_bytes) {
  v1::Progress former;
  former.ParseFromString(former_bytes);
  return queued_progress(former).SerializeAsString();
}

std::string lost_error(const LostAttempt& lost, const Loss& loss) {
  const auto attempts = 1 + std::ranges::count(lost.losses, kLossEnd);
  const std::string detail = fmt::format("{} attempts in a row were lost: {}", attempts, lost.losses);
  return crease::to_problem(crease::Error(std::string(loss.code), detail)).SerializeAsString();
}

void queue_again(Connection& connection, const LostAttempt& lost) {
  const std::string progress = queued_progress_bytes(lost.progress);
  Query(connection,
        "UPDATE jobs SET state = 'queued', started = NULL, strikes = ?, losses = ?, progress = ?, lease_owner = NULL,"
        " version = (SELECT version FROM change_counter) WHERE id = ?",
        static_cast<std::int64_t>(lost.strikes), lost.losses, Blob{progress}, lost.claim.job_id)
      .run();
  spdlog::warn("job {} queued again: {}", lost.claim.job_id, lost.losses);
}

/// Removes the working files of an ended job. Returns the number of bytes that it keeps on the disk.
std::int64_t kept_bytes(const JobFiles& files, std::string_view id) {
  files.remove_working_files(id);
  return files.bytes(id);
}

void end_lost(Connection& connection, const JobFiles& files, const LostAttempt& lost, std::string_view state,
              const std::string& error, std::int64_t now) {
  Query(connection,
        "UPDATE jobs SET state = ?1, finished = ?2, expires = ?2 + retention, error = ?3, losses = ?4,"
        " bytes = ?5, lease_owner = NULL, version = (SELECT version FROM change_counter) WHERE id = ?6",
        state, now, Blob{error}, lost.losses, kept_bytes(files, lost.claim.job_id), lost.claim.job_id)
      .run();
  spdlog::error("job {} {}: {}", lost.claim.job_id, state, lost.losses);
}

/// Counts a lost attempt. The count restarts when the attempt made progress, unless it exceeded a limit.
void lose_attempt(Connection& connection, const JobFiles& files, LostAttempt lost, const Loss& loss,
                  std::uint32_t max_attempts, std::int64_t now) {
  const std::string what = fmt::format("attempt {} {}", lost.claim.attempt, loss.what);
  const std::uint32_t strikes = loss.with_server ? 1 : kStrikesOfAttempt;
  const bool count_anew = (lost.progressed && !loss.by_limit) || lost.strikes == 0;
  lost.losses = count_anew ? what : fmt::format("{}{} {}", lost.losses, kLossEnd, what);
  lost.strikes = count_anew ? strikes : lost.strikes + strikes;
  if (lost.cancel_requested) {
    end_lost(connection, files, lost, "cancelled", {}, now);
  } else if (lost.strikes >= max_attempts * kStrikesOfAttempt) {
    end_lost(connection, files, lost, "failed", lost_error(lost, loss), now);
  } else {
    queue_again(connection, lost);
  }
}

void lose_expired(Connection& connection, const JobFiles& files, std::int64_t now, std::uint32_t max_attempts) {
  const Loss loss{.what = "stopped responding: its lease expired"};
  for (LostAttempt& lost : lost_attempts(connection, "?1 = '' AND lease_until <= ?2", "", now)) {
    lose_attempt(connection, files, std::move(lost), loss, max_attempts, now);
  }
}

std::optional<std::int64_t> oldest_queued(Connection& connection) {
  Query row(connection, "SELECT min(seq) FROM jobs WHERE state = 'queued'");
  row.next();
  return row.optional_integer(0);
}

std::optional<Claim> claim_row(Connection& connection, std::int64_t seq, std::string_view owner, std::int64_t now,
                               std::int64_t lease_until) {
  Query row(connection,
            "UPDATE jobs SET state = 'running', started = ?, attempt = attempt + 1, progressed = 0, lease_owner = ?,"
            " lease_until = ?, version = (SELECT version FROM change_counter) WHERE seq = ? RETURNING id, attempt",
            now, owner, lease_until, seq);
  row.next();
  return Claim{row.text(0), std::string(owner), static_cast<std::uint32_t>(row.integer(1))};
}

/// The job of a claim that is still valid, read inside a transaction.
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

}  // namespace

std::optional<Claim> SqliteStore::claim(std::string_view owner, std::chrono::milliseconds lease) {
  return with_store_errors([&]() -> std::optional<Claim> {
    const std::int64_t now = now_ms();
    {
      // Idle workers look often, so they look without the write lock first.
      ReaderPool::Loan reader(readers_);
      if (!oldest_claimable(*reader, now)) return std::nullopt;
    }
    Writer::Transaction transaction(writer_);
    count_change(*transaction);
    lose_expired(*transaction, files_, now, max_attempts_);
    std::optional<Claim> claim;
    if (const auto seq = oldest_queued(*transaction)) {
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
    for (const auto& warning : warnings) crease::add_once(warning, *job->mutable_warnings());
    const std::string all_warnings = warnings_bytes(job->warnings()), result_bytes = result.SerializeAsString(),
                      progress = finished_progress(job->progress()).SerializeAsString();
    count_change(*transaction);
    Query(
        *transaction,
        "UPDATE jobs SET state = 'succeeded', finished = ?1, expires = ?1 + retention, result = ?2, warnings = ?3,"
        " progress = ?4, bytes = ?5, lease_owner = NULL, version = (SELECT version FROM change_counter) WHERE id = ?6",
        now_ms(), Blob{result_bytes}, Blob{all_warnings}, Blob{progress}, kept_bytes(files_, claim.job_id),
        claim.job_id)
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
    const int rows =
        Query(*transaction,
              "UPDATE jobs SET state = 'failed', finished = ?1, expires = ?1 + retention, error = ?2,"
              " bytes = ?3, lease_owner = NULL, version = (SELECT version FROM change_counter)"
              " WHERE id = ?4 AND lease_owner = ?5 AND attempt = ?6 AND state = 'running'",
              now_ms(), Blob{error}, kept_bytes(files_, claim.job_id), claim.job_id, claim.owner, claim.attempt)
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
                           "UPDATE jobs SET state = 'cancelled', finished = ?1, expires = ?1 + retention, bytes = ?2,"
                           " lease_owner = NULL, version = (SELECT version FROM change_counter)"
                           " WHERE id = ?3 AND lease_owner = ?4 AND attempt = ?5 AND state = 'running'",
                           now_ms(), kept_bytes(files_, claim.job_id), claim.job_id, claim.owner, claim.attempt)
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
          " finished = iif(cancel_requested, ?1, NULL), expires = iif(cancel_requested, ?1 + retention, NULL), started "
          "= iif(cancel_requested, started, NULL),"
          " attempt = attempt - iif(cancel_requested, 0, 1), progress = iif(cancel_requested, progress, ?2),"
          " lease_owner = NULL,"
          " version = (SELECT version FROM change_counter) WHERE id = ?3",
          now_ms(), Blob{progress}, claim.job_id)
        .run();
    transaction.commit();
    return true;
  });
}

void SqliteStore::note_checkpoint(const Claim& claim) {
  with_store_errors([&] {
    Writer::Transaction transaction(writer_);
    Query(*transaction,
          "UPDATE jobs SET progressed = 1"
          " WHERE id = ? AND lease_owner = ? AND attempt = ? AND state = 'running' AND progressed = 0",
          claim.job_id, claim.owner, claim.attempt)
        .run();
    transaction.commit();
  });
}

bool SqliteStore::lose(const Claim& claim, const Loss& loss) {
  return with_store_errors([&] {
    Writer::Transaction transaction(durable_writer_);
    auto lost = lost_attempts(*transaction, "id = ?1 AND attempt = ?2", claim.job_id, claim.attempt);
    if (lost.empty() || lost.front().claim.owner != claim.owner) return false;
    count_change(*transaction);
    lose_attempt(*transaction, files_, std::move(lost.front()), loss, max_attempts_, now_ms());
    transaction.commit();
    return true;
  });
}

std::vector<std::string> SqliteStore::busy_workers() {
  return with_store_errors([&] {
    ReaderPool::Loan reader(readers_);
    Query rows(*reader, "SELECT DISTINCT lease_owner FROM jobs WHERE state = 'running'");
    std::vector<std::string> names;
    while (rows.next()) names.push_back(rows.text(0));
    return names;
  });
}

void SqliteStore::lose_all(std::string_view worker, const Loss& loss) {
  with_store_errors([&] {
    Writer::Transaction transaction(durable_writer_);
    count_change(*transaction);
    auto all = lost_attempts(*transaction, "lease_owner = ?1 AND ?2", worker, 1);
    for (LostAttempt& lost : all) lose_attempt(*transaction, files_, std::move(lost), loss, max_attempts_, now_ms());
    if (!all.empty()) transaction.commit();
  });
}

}  // namespace creased
