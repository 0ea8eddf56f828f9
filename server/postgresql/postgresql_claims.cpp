#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "proto/convert.h"
#include "server/base/failure.h"
#include "server/postgresql/job_rows.h"
#include "server/postgresql/postgresql_store.h"
#include "server/store/job_facts.h"

namespace creased {
namespace code = crease::code;
namespace v1 = crease::v1;
namespace {

using std::chrono::milliseconds;

// Of advisory locks in this database: claims are made one after the other, so that their order is exact.
constexpr std::int64_t kClaimLock = 0x636c61696d;

/// How long nobody asks the database without a signal of it.
constexpr milliseconds kLongestIdle{5'000}, kLongestSilence{2'000};

constexpr std::string_view kHeld = "id = $1 AND lease_owner = $2 AND attempt = $3 AND state = 'running'";

// A lease that nobody could renew, because the database was away, does not count until there was time to renew it.
constexpr std::string_view kExpired =
    "state = 'running' AND lease_until <= now.ms AND (leased >= start.ms OR now.ms - start.ms >= lease_until - leased)";
constexpr std::string_view kTimes =
    "(SELECT now_ms() AS ms) AS now,"
    " (SELECT (extract(epoch FROM pg_postmaster_start_time()) * 1000)::bigint AS ms) AS start";

std::string select_running_jobs(std::string_view rest) {
  return fmt::format("SELECT {}, id, progress FROM jobs{}", columns_of_life(), rest);
}

}  // namespace

std::optional<PostgresqlStore::RunningJob> PostgresqlStore::held(Transaction& transaction, const Claim& claim) {
  static const std::string sql = select_running_jobs(fmt::format(" WHERE {} FOR UPDATE", kHeld));
  const auto rows = transaction.run(sql, claim.job_id, claim.owner, claim.attempt);
  if (rows.empty()) return std::nullopt;
  return RunningJob{claim.job_id, life_in(rows[0]), bytes_of(rows[0][kColumnsOfLife + 1])};
}

/// Takes a step of a job that is locked. Returns the number of the change.
std::int64_t PostgresqlStore::take(Transaction& transaction, const RunningJob& job, const Transition& step) {
  const Life& life = step.life;
  const std::string progress = progress_after(job.progress, life.state),
                    error = step.error ? step.error->SerializeAsString() : std::string();
  const bool ends = is_terminal(life.state);
  if (ends || life.state == JobState::kQueued) {
    const auto gone = transaction.run("DELETE FROM files WHERE job = $1 AND name IN ($2, $3)", job.id, file::kSnapshot,
                                      ends ? file::kCheckpoint : file::kSnapshot);
    if (gone.affected_rows() > 0) has_removed_ = true;
  }
  if (life.state == JobState::kQueued) tell(transaction, Channel::kQueue);
  const auto version =
      transaction
          .run(
              "UPDATE jobs SET state = $2, attempt = $3, strikes = $4, deferrals = $5, progressed = $6,"
              " cancel_requested = $7, losses = $8, progress = $10, error = nullif($11::bytea, ''),"
              " not_before = CASE WHEN $9::bigint = 0 THEN 0 ELSE now + $9::bigint END,"
              " started = CASE WHEN $2 = 'queued' THEN NULL ELSE started END,"
              " lease_owner = CASE WHEN $2 = 'running' THEN lease_owner END,"
              " finished = CASE WHEN $12 THEN now END, expires = CASE WHEN $12 THEN now + retention END,"
              " bytes = CASE WHEN $12 THEN (SELECT coalesce(sum(files.bytes), 0) FROM files WHERE job = $1) ELSE bytes "
              "END,"
              " version = count_change() FROM now_ms() AS now WHERE id = $1 RETURNING version",
              job.id, text_of(life.state), life.attempt, life.strikes, life.deferrals, life.progressed,
              life.cancel_requested, life.losses, static_cast<std::int64_t>(step.wait.count()), Bytes{progress},
              Bytes{error}, ends)[0][0]
          .as<std::int64_t>();
  const std::lock_guard lock(mutex_);
  look_for_work_at_ = {};
  look_for_expired_at_ = {};
  return version;
}

bool PostgresqlStore::take(const Claim& claim, const Step& step) {
  const bool taken = guarded([&] {
    Transaction transaction(sessions_);
    const auto job = held(transaction, claim);
    if (!job) return false;
    const Transition next = step(job->life);
    commit(transaction, take(transaction, *job, next));
    log_step(job->id, next);
    return true;
  });
  tidy_after(claim);
  return taken;
}

std::size_t PostgresqlStore::lose_jobs(Transaction& transaction, const pqxx::result& rows, const Loss& loss,
                                       std::int64_t& version) {
  for (const auto& row : rows) {
    const RunningJob job{row[kColumnsOfLife].as<std::string>(), life_in(row), bytes_of(row[kColumnsOfLife + 1])};
    const Transition step = lost(job.life, loss, options_.max_attempts);
    version = take(transaction, job, step);
    log_step(job.id, step);
  }
  if (!rows.empty()) tell(transaction, Channel::kHolds);
  return rows.size();
}

void PostgresqlStore::lose_expired(Transaction& transaction, std::int64_t& version) {
  static const std::string sql = select_running_jobs(
      fmt::format(", {} WHERE {} ORDER BY seq LIMIT 100 FOR UPDATE OF jobs SKIP LOCKED", kTimes, kExpired));
  lose_jobs(transaction, transaction.run(sql), {.what = "stopped responding: its lease expired"}, version);
}

/// Whether to ask the database for work: it has told that there may be some, or the time has come to look.
bool PostgresqlStore::may_have_work() {
  const auto signals = listener_.signals(Channel::kQueue);
  const std::lock_guard lock(mutex_);
  const bool told = signals != heard_of_work_;
  if (!told && Clock::now() < look_for_work_at_) return false;
  heard_of_work_ = signals;
  return true;
}

/// When there is no work, notes when to look again.
PostgresqlStore::Work PostgresqlStore::look_for_work(Transaction& transaction) {
  static const std::string sql = fmt::format(
      "SELECT EXISTS (SELECT 1 FROM jobs WHERE state = 'queued' AND not_before <= (SELECT now_ms())),"
      " EXISTS (SELECT 1 FROM jobs, {} WHERE {}),"
      " least((SELECT min(not_before) FROM jobs WHERE state = 'queued' AND not_before > 0),"
      " (SELECT min(lease_until) FROM jobs WHERE state = 'running')) - now_ms()",
      kTimes, kExpired);
  const auto row = transaction.run(sql)[0];
  const Work work{.queued = row[0].as<bool>(), .expired = row[1].as<bool>()};
  if (work.queued || work.expired) return work;
  constexpr std::int64_t kShortest = 20;
  const std::int64_t due = row[2].is_null() ? kLongestIdle.count() : row[2].as<std::int64_t>();
  const std::lock_guard lock(mutex_);
  look_for_work_at_ = Clock::now() + milliseconds(std::clamp<std::int64_t>(due, kShortest, kLongestIdle.count()));
  return work;
}

std::optional<Claim> PostgresqlStore::claim_next(Transaction& transaction, std::string_view worker, milliseconds lease,
                                                 std::int64_t& version) {
  static const std::string sql = fmt::format(
      "SELECT next.* FROM (SELECT owner, coalesce(running, 0) AS running, served FROM usage LEFT JOIN"
      " (SELECT owner AS runner, count(*) AS running FROM jobs WHERE state = 'running' GROUP BY owner) AS runners"
      " ON runner = owner WHERE queued > 0 ORDER BY running, served, owner) AS keys CROSS JOIN LATERAL"
      " (SELECT {}, id FROM jobs WHERE state = 'queued' AND jobs.owner = keys.owner AND not_before <= (SELECT now_ms())"
      " ORDER BY rank, seq LIMIT 1 FOR UPDATE SKIP LOCKED) AS next ORDER BY running, served, keys.owner LIMIT 1",
      columns_of_life());
  const auto rows = transaction.run(sql);
  if (rows.empty()) return std::nullopt;
  const Life life = claimed(life_in(rows[0]));
  const Claim claim{rows[0][kColumnsOfLife].as<std::string>(), std::string(worker), life.attempt};
  version = transaction
                .run(
                    "UPDATE jobs SET state = $2, attempt = $3, progressed = $4, lease_owner = $5, started = now,"
                    " leased = now, lease_until = now + $6::bigint, version = count_change() FROM now_ms() AS now"
                    " WHERE id = $1 RETURNING version",
                    claim.job_id, text_of(life.state), life.attempt, life.progressed, worker,
                    static_cast<std::int64_t>(lease.count()))[0][0]
                .as<std::int64_t>();
  files_.reserve(working_path(claim, file::kResult).parent_path().filename().string());
  return claim;
}

std::optional<Claim> PostgresqlStore::claim(std::string_view worker, milliseconds lease) {
  if (!may_have_work()) return std::nullopt;
  return guarded([&]() -> std::optional<Claim> {
    const bool leases_count = leases_.trusted(lease);
    refuse_claims_of_a_sick_store();
    std::int64_t version = 0;
    Transaction transaction(sessions_);
    const Work work = look_for_work(transaction);
    if (!work.queued && !work.expired) return std::nullopt;
    transaction.run("SELECT pg_advisory_xact_lock($1), set_config('synchronous_commit', 'off', true)", kClaimLock);
    if (work.expired && leases_count) lose_expired(transaction, version);
    auto claim = claim_next(transaction, worker, lease, version);
    if (version > 0) commit(transaction, version);
    const std::lock_guard lock(mutex_);
    if (!claim) return claim;
    look_for_work_at_ = {};
    checkpoint_ = {Pace(kPartsOfCheckpoints)};
    snapshot_ = {Pace(kPartsOfSnapshots)};
    return claim;
  });
}

void PostgresqlStore::remember(const Claim& claim, Hold hold, std::uint64_t signals) {
  const std::lock_guard lock(mutex_);
  checked_ = {claim, hold, signals, Clock::now() + kLongestSilence};
}

Store::Hold PostgresqlStore::check(const Claim& claim) {
  const auto signals = listener_.signals(Channel::kHolds);
  {
    const std::lock_guard lock(mutex_);
    const bool known = checked_.claim.job_id == claim.job_id && checked_.claim.attempt == claim.attempt &&
                       checked_.claim.owner == claim.owner && checked_.signals == signals;
    if (known && Clock::now() < checked_.until) return checked_.hold;
    checked_.until = Clock::now() + kLongestSilence;  // and not again at once when this fails
  }
  return guarded([&] {
    static const std::string sql = fmt::format("SELECT cancel_requested FROM jobs WHERE {}", kHeld);
    Transaction transaction(sessions_);
    const auto rows = transaction.run(sql, claim.job_id, claim.owner, claim.attempt);
    const Hold hold = rows.empty() ? Hold::kLost : rows[0][0].as<bool>() ? Hold::kCancelRequested : Hold::kHeld;
    remember(claim, hold, signals);
    return hold;
  });
}

Store::Hold PostgresqlStore::renew(const Claim& claim, milliseconds lease) {
  return guarded([&] {
    static const std::string sql = fmt::format(
        "UPDATE jobs SET leased = now, lease_until = now + $4::bigint FROM now_ms() AS now WHERE {}"
        " RETURNING cancel_requested",
        kHeld);
    Transaction transaction(sessions_);
    transaction.relax();
    const auto rows =
        transaction.run(sql, claim.job_id, claim.owner, claim.attempt, static_cast<std::int64_t>(lease.count()));
    transaction.commit();
    if (rows.empty()) return Hold::kLost;
    return rows[0][0].as<bool>() ? Hold::kCancelRequested : Hold::kHeld;
  });
}

void PostgresqlStore::publish_progress(const Claim& claim, const v1::Progress& progress) {
  guarded([&] {
    // The job is locked before the change is counted.
    static const std::string sql = fmt::format(
        "WITH held AS (SELECT seq FROM jobs WHERE {} FOR UPDATE)"
        " UPDATE jobs SET progress = $4, version = count_change() FROM held WHERE jobs.seq = held.seq RETURNING "
        "version",
        kHeld);
    const std::string bytes = progress.SerializeAsString();
    Transaction transaction(sessions_);
    transaction.relax();
    const auto rows = transaction.run(sql, claim.job_id, claim.owner, claim.attempt, Bytes{bytes});
    if (!rows.empty()) commit(transaction, rows[0][0].as<std::int64_t>());
  });
}

void PostgresqlStore::note_checkpoint(const Claim& claim) {
  {
    const std::lock_guard lock(mutex_);
    checkpoint_.newer_here = true;
    if (!checkpoint_.pace.due()) return;
  }
  store_passing(claim, file::kCheckpoint, checkpoint_);
}

void PostgresqlStore::note_snapshot(const Claim& claim) {
  {
    const std::lock_guard lock(mutex_);
    if (!snapshot_.pace.due()) return;
  }
  store_passing(claim, file::kSnapshot, snapshot_);
}

void PostgresqlStore::store_passing(const Claim& claim, std::string_view name, PassingFile& passing) {
  const bool checkpoint = name == file::kCheckpoint;
  const auto started = Clock::now();
  const auto path = working_path(claim, name);
  guarded([&] {
    Transaction transaction(sessions_);
    transaction.relax();
    const BlobRef blob = write_blob(transaction, open_to_read(path).get(), path);
    const auto job = held(transaction, claim);
    if (!job) return;
    put_file(transaction, claim.job_id, {std::string(name), blob.bytes, {}}, blob);
    if (checkpoint) {
      const Life life = progressed(job->life);
      transaction.run("UPDATE jobs SET progressed = $2, deferrals = $3 WHERE id = $1", claim.job_id, life.progressed,
                      life.deferrals);
    }
    transaction.commit();
  });
  discard_removed();
  const std::lock_guard lock(mutex_);
  passing.newer_here = false;
  passing.pace.note(started);
}

bool PostgresqlStore::succeed(const Claim& claim, const v1::ResultFacts& result,
                              const std::vector<v1::Warning>& warnings, const std::vector<FileRecord>& files) {
  const bool taken = guarded([&] {
    Transaction transaction(sessions_);
    std::vector<BlobRef> blobs;
    for (const FileRecord& file : files) {
      const auto path = working_path(claim, file.name);
      blobs.push_back(write_blob(transaction, open_to_read(path).get(), path));
    }
    const auto running = held(transaction, claim);
    if (!running) return false;
    auto job = job_with_id(transaction, claim.job_id);
    for (const auto& warning : warnings) crease::add_once(warning, *job->mutable_warnings());
    for (std::size_t i = 0; i < files.size(); ++i) put_file(transaction, claim.job_id, files[i], blobs[i]);
    const std::string all_warnings = warnings_bytes(job->warnings()), result_bytes = result.SerializeAsString();
    transaction.run("UPDATE jobs SET result = $2, warnings = $3 WHERE id = $1", claim.job_id, Bytes{result_bytes},
                    Bytes{all_warnings});
    commit(transaction, take(transaction, *running, {ended(running->life, JobState::kSucceeded)}));
    return true;
  });
  tidy_after(claim);
  return taken;
}

bool PostgresqlStore::put_back(const Claim& claim) {
  bool newer_here = false;
  {
    const std::lock_guard lock(mutex_);
    newer_here = checkpoint_.newer_here;
  }
  if (newer_here) store_passing(claim, file::kCheckpoint, checkpoint_);
  return DatabaseStore::put_back(claim);
}

std::vector<std::string> PostgresqlStore::busy_workers() {
  return guarded([&] {
    Transaction transaction(sessions_);
    std::vector<std::string> names;
    for (const auto& row : transaction.run("SELECT DISTINCT lease_owner FROM jobs WHERE state = 'running'")) {
      names.push_back(row[0].as<std::string>());
    }
    return names;
  });
}

void PostgresqlStore::lose_all(std::string_view worker, const Loss& loss) {
  guarded([&] {
    static const std::string sql =
        select_running_jobs(" WHERE state = 'running' AND lease_owner = $1 ORDER BY seq FOR UPDATE");
    Transaction transaction(sessions_);
    std::int64_t version = 0;
    if (lose_jobs(transaction, transaction.run(sql, worker), loss, version) > 0) commit(transaction, version);
  });
}

std::filesystem::path PostgresqlStore::working_path(const Claim& claim, std::string_view name) const {
  return files_.path(fmt::format("{}-{}", claim.job_id, claim.attempt), name);
}

/// Removes what only the running job needed. What is left is removed later, as of a killed process.
void PostgresqlStore::tidy_after(const Claim& claim) {
  std::error_code ignored;
  std::filesystem::remove_all(working_path(claim, file::kResult).parent_path(), ignored);
  if (!has_removed_.exchange(false)) return;
  try {
    discard_removed();
  } catch (const crease::Error& error) {
    spdlog::debug("files are not discarded yet: {}", error.detail());
  }
}

}  // namespace creased
