#include "server/store/sqlite_schema.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>

#include <array>

#include "server/base/durable_file.h"
#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;
namespace {

// Only append to this list; never change a released migration. Times are milliseconds since 1970, messages are
// protobuf.
constexpr std::array kMigrations = {
    R"sql(
      CREATE TABLE change_counter (version INTEGER NOT NULL);
      INSERT INTO change_counter VALUES (0);
      CREATE TABLE jobs (
        seq INTEGER PRIMARY KEY AUTOINCREMENT,
        id TEXT NOT NULL UNIQUE,
        state TEXT NOT NULL CHECK (state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')),
        created INTEGER NOT NULL,
        started INTEGER,
        finished INTEGER,
        attempt INTEGER NOT NULL DEFAULT 0,
        lease_owner TEXT,
        lease_until INTEGER,
        cancel_requested INTEGER NOT NULL DEFAULT 0,
        version INTEGER NOT NULL,
        input BLOB NOT NULL,
        parameters BLOB NOT NULL,
        warnings BLOB NOT NULL,
        progress BLOB NOT NULL,
        result BLOB,
        error BLOB,
        idempotency_key TEXT UNIQUE,
        request_digest TEXT NOT NULL
      );
      CREATE INDEX jobs_by_state ON jobs (state, seq);
      CREATE INDEX jobs_by_version ON jobs (version);
    )sql",
    // Adds owners, each with its own idempotency keys; the history of lost attempts; expiry; the bytes kept, which
    // triggers add up so that no code path can forget them; and the removed jobs whose files still exist.
    R"sql(
      CREATE TABLE new_jobs (
        seq INTEGER PRIMARY KEY AUTOINCREMENT,
        id TEXT NOT NULL UNIQUE,
        owner TEXT NOT NULL DEFAULT '',
        state TEXT NOT NULL CHECK (state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')),
        created INTEGER NOT NULL,
        started INTEGER,
        finished INTEGER,
        expires INTEGER,
        retention INTEGER NOT NULL DEFAULT 86400000,
        attempt INTEGER NOT NULL DEFAULT 0,
        strikes INTEGER NOT NULL DEFAULT 0,
        progressed INTEGER NOT NULL DEFAULT 0,
        losses TEXT NOT NULL DEFAULT '',
        lease_owner TEXT,
        lease_until INTEGER,
        cancel_requested INTEGER NOT NULL DEFAULT 0,
        version INTEGER NOT NULL,
        bytes INTEGER NOT NULL DEFAULT 0,
        input BLOB NOT NULL,
        parameters BLOB NOT NULL,
        warnings BLOB NOT NULL,
        progress BLOB NOT NULL,
        result BLOB,
        error BLOB,
        idempotency_key TEXT,
        request_digest TEXT NOT NULL,
        UNIQUE (owner, idempotency_key)
      );
      INSERT INTO new_jobs (seq, id, state, created, started, finished, expires, attempt, lease_owner, lease_until,
                            cancel_requested, version, input, parameters, warnings, progress, result, error,
                            idempotency_key, request_digest)
        SELECT seq, id, state, created, started, finished,
               iif(finished IS NULL, NULL, CAST(strftime('%s', 'now') AS INTEGER) * 1000 + 86400000),
               attempt, lease_owner, lease_until, cancel_requested, version, input, parameters, warnings, progress,
               result, error, idempotency_key, request_digest
        FROM jobs;
      DROP TABLE jobs;
      ALTER TABLE new_jobs RENAME TO jobs;
      CREATE INDEX jobs_by_state ON jobs (state, seq);
      CREATE INDEX jobs_by_version ON jobs (version);
      CREATE INDEX jobs_by_owner ON jobs (owner, seq);
      CREATE INDEX jobs_by_expiry ON jobs (expires) WHERE expires IS NOT NULL;
      CREATE TABLE usage (owner TEXT PRIMARY KEY, queued INTEGER NOT NULL, bytes INTEGER NOT NULL) WITHOUT ROWID;
      INSERT INTO usage SELECT owner, sum(state = 'queued'), sum(bytes) FROM jobs GROUP BY owner;
      CREATE TRIGGER count_new_job AFTER INSERT ON jobs BEGIN
        INSERT INTO usage VALUES (new.owner, new.state = 'queued', new.bytes)
          ON CONFLICT (owner) DO UPDATE SET queued = queued + excluded.queued, bytes = bytes + excluded.bytes;
      END;
      CREATE TRIGGER count_changed_job AFTER UPDATE OF state, bytes ON jobs BEGIN
        UPDATE usage SET queued = queued + (new.state = 'queued') - (old.state = 'queued'),
                         bytes = bytes + new.bytes - old.bytes
          WHERE owner = new.owner;
      END;
      CREATE TABLE removed (id TEXT PRIMARY KEY) WITHOUT ROWID;
      CREATE TRIGGER count_removed_job AFTER DELETE ON jobs BEGIN
        UPDATE usage SET queued = queued - (old.state = 'queued'), bytes = bytes - old.bytes WHERE owner = old.owner;
        INSERT OR IGNORE INTO removed VALUES (old.id);
      END;
    )sql",
    // Adds what makes a job wait and what orders the queue; the share that each owner was served; what the complete
    // files of a job are; and what workers say of themselves.
    R"sql(
      ALTER TABLE jobs ADD COLUMN not_before INTEGER NOT NULL DEFAULT 0;
      ALTER TABLE jobs ADD COLUMN deferrals INTEGER NOT NULL DEFAULT 0;
      ALTER TABLE jobs ADD COLUMN rank INTEGER NOT NULL DEFAULT 0;
      UPDATE jobs SET rank = created;
      CREATE INDEX queue ON jobs (owner, rank, seq) WHERE state = 'queued';
      ALTER TABLE usage ADD COLUMN served INTEGER NOT NULL DEFAULT 0;
      DROP TRIGGER count_new_job;
      CREATE TRIGGER count_new_job AFTER INSERT ON jobs BEGIN
        INSERT INTO usage (owner, queued, bytes) VALUES (new.owner, new.state = 'queued', new.bytes)
          ON CONFLICT (owner) DO UPDATE SET queued = queued + excluded.queued, bytes = bytes + excluded.bytes;
      END;
      CREATE TABLE files (
        job TEXT NOT NULL,
        name TEXT NOT NULL,
        bytes INTEGER NOT NULL,
        sha256 TEXT NOT NULL,
        PRIMARY KEY (job, name)
      ) WITHOUT ROWID;
      CREATE TRIGGER forget_files AFTER DELETE ON jobs BEGIN
        DELETE FROM files WHERE job = old.id;
      END;
      CREATE TABLE clock (boot TEXT NOT NULL, offset INTEGER NOT NULL);
      CREATE TABLE workers (name TEXT PRIMARY KEY, seen INTEGER NOT NULL, problem TEXT NOT NULL) WITHOUT ROWID;
    )sql",
};

int user_version(SQLite::Database& database) { return database.execAndGet("PRAGMA user_version").getInt(); }

void migrate(SQLite::Database& database) {
  const int present = static_cast<int>(kMigrations.size());
  const int found = user_version(database);
  if (found > present) {
    throw crease::Error(
        code::kStoreUnavailable,
        fmt::format("the database has schema version {}; this program supports versions up to {}", found, present));
  }
  for (int next = found; next < present; ++next) {
    SQLite::Transaction transaction(database, SQLite::TransactionBehavior::IMMEDIATE);
    database.exec(kMigrations.at(static_cast<std::size_t>(next)));
    database.exec(fmt::format("PRAGMA user_version = {}", next + 1));
    transaction.commit();
  }
}

}  // namespace

void prepare_database(const std::filesystem::path& path) {
  // Unlike other statements, the switch to WAL does not wait for locks, so only one process at a time may try it.
  const std::filesystem::path lock_path = path.parent_path() / "creased.lock";
  const Descriptor lock(::open(lock_path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
  if (!lock.open()) throw file_failure("open", lock_path);
  if (::flock(lock.get(), LOCK_EX) != 0) throw file_failure("lock", lock_path);

  constexpr int kPatienceMs = 10'000;
  SQLite::Database database(path.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE, kPatienceMs);
  database.exec("PRAGMA journal_mode = WAL");
  migrate(database);
}

}  // namespace creased
