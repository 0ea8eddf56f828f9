#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cstdio>

#include "proto/convert.h"
#include "server/base/failure.h"
#include "server/store/job_facts.h"
#include "server/store/job_row.h"
#include "server/store/sqlite_store.h"

namespace creased {
namespace code = crease::code;
namespace v1 = crease::v1;
namespace {

// ?1 is the current time and ?2 the longest wait: a time further away than that was written before the clock was set
// back.
constexpr std::string_view kDue = "state = 'queued' AND (not_before <= ?1 OR not_before > ?1 + ?2)";

// A worker's right to a job.
constexpr std::string_view kHeldBy = "id = ? AND lease_owner = ? AND attempt = ? AND state = 'running'";

bool anything_to_do(Connection& connection, std::int64_t now) {
  static const std::string sql = fmt::format(
      "SELECT EXISTS (SELECT 1 FROM jobs WHERE {})"
      " OR EXISTS (SELECT 1 FROM jobs WHERE state = 'running' AND lease_until <= ?1)",
      kDue);
  Query row(connection, sql, now, kLongestDeferral.count());
  row.next();
  return row.integer(0) != 0;
}

/// Owners of queued jobs, in the order in which they are served.
std::vector<std::string> owners_in_order(Connection& connection) {
  Query rows(connection,
             "SELECT owner FROM usage LEFT JOIN"
             " (SELECT owner AS runner, count(*) AS running FROM jobs WHERE state = 'running' GROUP BY owner)"
             " ON runner = owner WHERE queued > 0 ORDER BY coalesce(running, 0), served, owner");
  std::vector<std::string> owners;
  while (rows.next()) owners.push_back(rows.text(0));
  return owners;
}

std::optional<std::int64_t> next_of(Connection& connection, const std::string& owner, std::int64_t now) {
  static const std::string sql =
      fmt::format("SELECT seq FROM jobs INDEXED BY queue WHERE {} AND owner = ?3 ORDER BY rank, seq LIMIT 1", kDue);
  Query row(connection, sql, now, kLongestDeferral.count(), owner);
  if (!row.next()) return std::nullopt;
  return row.integer(0);
}

Store::Hold read_hold(Query& row) {
  if (!row.next()) return Store::Hold::kLost;
  return row.integer(0) != 0 ? Store::Hold::kCancelRequested : Store::Hold::kHeld;
}

/// A running job, inside a transaction.
struct RunningJob {
  std::string id;
  Life life;
  std::string progress;
};

RunningJob read_running(const Query& row) { return {row.text(0), read_life(row, 1), row.text(1 + kLifeColumns)}; }

std::string select_running(std::string_view condition) {
  return fmt::format("SELECT id, {}, progress FROM jobs WHERE {}", life_columns(), condition);
}

std::optional<RunningJob> held(Connection& connection, const Claim& claim) {
  static const std::string sql = select_running(kHeldBy);
  Query row(connection, sql, claim.job_id, claim.owner, claim.attempt);
  if (!row.next()) return std::nullopt;
  return read_running(row);
}

void record(Connection& connection, const std::string& id, const FileRecord& file) {
  Query(connection, "INSERT OR REPLACE INTO files VALUES (?, ?, ?, ?)", id, file.name,
        static_cast<std::int64_t>(file.bytes), file.sha256)
      .run();
}

}  // namespace

void SqliteStore::take(Connection& connection, const std::string& id, const std::string& progress,
                       const Transition& step) {
  const Life& life = step.life;
  const std::int64_t now = now_ms();
  const std::string error = step.error ? step.error->SerializeAsString() : std::string();
  if (is_terminal(life.state)) files_.remove_working_files(id);
  const std::int64_t not_before = step.wait.count() == 0 ? 0 : now + step.wait.count();
  count_change(connection);
  Query(connection,
        "UPDATE jobs SET state = ?2, attempt = ?3, strikes = ?4, deferrals = ?5, progressed = ?6,"
        " cancel_requested = ?7, losses = ?8, not_before = ?9, progress = ?10, error = nullif(?11, x''),"
        " started = iif(?2 = 'queued', NULL, started), lease_owner = iif(?2 = 'running', lease_owner, NULL),"
        " version = (SELECT version FROM change_counter) WHERE id = ?1",
        id, name_of(life.state), life.attempt, life.strikes, life.deferrals, int{life.progressed},
        int{life.cancel_requested}, life.losses, not_before, Blob{progress}, Blob{error})
      .run();
  if (!is_terminal(life.state)) return;
  Query(connection, "UPDATE jobs SET finished = ?1, expires = ?1 + retention, bytes = ?2 WHERE id = ?3", now,
        files_.bytes(id), id)
      .run();
}

bool SqliteStore::take(const Claim& claim, const Step& step) {
  return guarded([&] {
    Writer::Transaction transaction(durable_writer_);
    const auto job = held(*transaction, claim);
    if (!job) return false;
    const Transition taken = step(job->life);
    take(*transaction, job->id, progress_after(job->progress, taken.life.state), taken);
    transaction.commit();
    log_step(job->id, taken);
    return true;
  });
}

/// The running jobs that `condition` selects lose their attempt. ?1 and ?2 belong to the condition.
std::size_t SqliteStore::lose_where(Connection& connection, std::string_view condition, std::string_view text,
                                    std::int64_t number, const Loss& loss) {
  std::vector<RunningJob> jobs;
  {
    Query rows(connection, select_running(fmt::format("state = 'running' AND {}", condition)), text, number);
    while (rows.next()) jobs.push_back(read_running(rows));
  }
  for (const RunningJob& job : jobs) {
    const Transition step = lost(job.life, loss, options_.max_attempts);
    take(connection, job.id, progress_after(job.progress, step.life.state), step);
    log_step(job.id, step);
  }
  return jobs.size();
}

std::optional<Claim> SqliteStore::claim_next(Connection& connection, std::string_view worker, std::int64_t now,
                                             std::chrono::milliseconds lease) {
  for (const std::string& owner : owners_in_order(connection)) {
    const auto seq = next_of(connection, owner, now);
    if (!seq) continue;
    Claim claim;
    claim.owner = worker;
    Life life;
    {
      Query row(connection, fmt::format("SELECT id, {} FROM jobs WHERE seq = ?", life_columns()), *seq);
      row.next();
      claim.job_id = row.text(0);
      life = claimed(read_life(row, 1));
    }
    claim.attempt = life.attempt;
    Query(connection,
          "UPDATE jobs SET state = ?, attempt = ?, progressed = ?, started = ?, lease_owner = ?, lease_until = ?,"
          " version = (SELECT version FROM change_counter) WHERE seq = ?",
          name_of(life.state), life.attempt, int{life.progressed}, now, worker, now + lease.count(), *seq)
        .run();
    Query(connection, "UPDATE usage SET served = (SELECT version FROM change_counter) WHERE owner = ?", owner).run();
    return claim;
  }
  return std::nullopt;
}

std::optional<Claim> SqliteStore::claim(std::string_view worker, std::chrono::milliseconds lease) {
  return guarded([&]() -> std::optional<Claim> {
    const std::int64_t now = now_ms();
    const bool leases_count = leases_.trusted(lease);
    {
      // Idle workers look often, so they look without the write lock first.
      ReaderPool::Loan reader(readers_);
      if (!anything_to_do(*reader, now)) return std::nullopt;
    }
    refuse_claims_of_a_sick_store();
    Writer::Transaction transaction(writer_);
    count_change(*transaction);
    if (leases_count) {
      lose_where(*transaction, "?1 = '' AND lease_until <= ?2", "", now,
                 {.what = "stopped responding: its lease expired"});
    }
    auto claim = claim_next(*transaction, worker, now, lease);
    transaction.commit();
    return claim;
  });
}

Store::Hold SqliteStore::check(const Claim& claim) {
  return guarded([&] {
    ReaderPool::Loan reader(readers_);
    static const std::string sql = fmt::format("SELECT cancel_requested FROM jobs WHERE {}", kHeldBy);
    Query row(*reader, sql, claim.job_id, claim.owner, claim.attempt);
    return read_hold(row);
  });
}

Store::Hold SqliteStore::renew(const Claim& claim, std::chrono::milliseconds lease) {
  return guarded([&] {
    Writer::Transaction transaction(writer_);
    Hold hold = Hold::kLost;
    {
      static const std::string sql =
          fmt::format("UPDATE jobs SET lease_until = ? WHERE {} RETURNING cancel_requested", kHeldBy);
      Query row(*transaction, sql, now_ms() + lease.count(), claim.job_id, claim.owner, claim.attempt);
      hold = read_hold(row);
    }
    transaction.commit();
    return hold;
  });
}

void SqliteStore::publish_progress(const Claim& claim, const v1::Progress& progress) {
  guarded([&] {
    const std::string bytes = progress.SerializeAsString();
    Writer::Transaction transaction(writer_);
    count_change(*transaction);
    static const std::string sql =
        fmt::format("UPDATE jobs SET progress = ?, version = (SELECT version FROM change_counter) WHERE {}", kHeldBy);
    Query(*transaction, sql, Blob{bytes}, claim.job_id, claim.owner, claim.attempt).run();
    transaction.commit();
  });
}

void SqliteStore::note_checkpoint(const Claim& claim) {
  guarded([&] {
    Writer::Transaction transaction(writer_);
    const auto job = held(*transaction, claim);
    if (!job || job->life.progressed) return;
    const Life life = progressed(job->life);
    Query(*transaction, "UPDATE jobs SET progressed = ?, deferrals = ? WHERE id = ?", int{life.progressed},
          life.deferrals, job->id)
        .run();
    transaction.commit();
  });
}

bool SqliteStore::succeed(const Claim& claim, const v1::ResultFacts& result, const std::vector<v1::Warning>& warnings,
                          const std::vector<FileRecord>& files) {
  return guarded([&] {
    Writer::Transaction transaction(durable_writer_);
    const auto running = held(*transaction, claim);
    if (!running) return false;
    auto job = job_of_id(*transaction, claim.job_id);
    for (const auto& warning : warnings) crease::add_once(warning, *job->mutable_warnings());
    const std::string all_warnings = warnings_bytes(job->warnings()), result_bytes = result.SerializeAsString();
    if (!files.empty()) write_end(claim.job_id, files);
    const Life life = ended(running->life, JobState::kSucceeded);
    take(*transaction, claim.job_id, progress_after(running->progress, life.state), {life});
    Query(*transaction, "UPDATE jobs SET result = ?, warnings = ? WHERE id = ?", Blob{result_bytes}, Blob{all_warnings},
          claim.job_id)
        .run();
    for (const FileRecord& file : files) record(*transaction, claim.job_id, file);
    transaction.commit();
    return true;
  });
}

std::vector<std::string> SqliteStore::busy_workers() {
  return guarded([&] {
    ReaderPool::Loan reader(readers_);
    Query rows(*reader, "SELECT DISTINCT lease_owner FROM jobs WHERE state = 'running'");
    std::vector<std::string> names;
    while (rows.next()) names.push_back(rows.text(0));
    return names;
  });
}

void SqliteStore::lose_all(std::string_view worker, const Loss& loss) {
  guarded([&] {
    Writer::Transaction transaction(durable_writer_);
    if (lose_where(*transaction, "lease_owner = ?1 AND ?2", worker, 1, loss) > 0) transaction.commit();
  });
}

bool SqliteStore::keep_file(std::string_view id, const FileRecord& file, const std::filesystem::path& made) {
  const auto room = files_.room();
  if (room.free < file.bytes + room.reserve()) return false;
  return guarded([&] {
    Writer::Transaction transaction(writer_);
    if (options_.quota_bytes > 0 && usage_of(*transaction, std::nullopt).bytes + file.bytes > options_.quota_bytes)
      return false;
    std::int64_t more = static_cast<std::int64_t>(file.bytes);
    {
      Query former(*transaction, "SELECT bytes FROM files WHERE job = ? AND name = ?", id, file.name);
      if (former.next()) more -= former.integer(0);
    }
    const int rows = Query(*transaction, "UPDATE jobs SET bytes = bytes + ? WHERE id = ?", more, id).run();
    if (rows == 0) return false;
    record(*transaction, std::string(id), file);
    transaction.commit();
    const auto target = files_.path(id, file.name);
    if (::rename(made.c_str(), target.c_str()) != 0) throw file_failure("keep", target);
    return true;
  });
}

std::optional<FileRecord> SqliteStore::file_record(std::string_view id, std::string_view name) {
  return guarded([&]() -> std::optional<FileRecord> {
    ReaderPool::Loan reader(readers_);
    Query row(*reader, "SELECT bytes, sha256 FROM files WHERE job = ? AND name = ?", id, name);
    if (!row.next()) return std::nullopt;
    return FileRecord{std::string(name), static_cast<std::uint64_t>(row.integer(0)), row.text(1)};
  });
}

}  // namespace creased
