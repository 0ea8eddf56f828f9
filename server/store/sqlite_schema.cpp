#include "server/store/sqlite_schema.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>

#include <array>

#include "server/store/durable_file.h"
#include "server/store/failure.h"

namespace creased {
namespace {

// Append only: a released migration never changes. Times are milliseconds since 1970; messages are protobuf.
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
};

int user_version(SQLite::Database& database) { return database.execAndGet("PRAGMA user_version").getInt(); }

void migrate(SQLite::Database& database) {
  const int present = static_cast<int>(kMigrations.size());
  const int found = user_version(database);
  if (found > present) {
    throw crease::Error(code::kStoreUnavailable,
                        fmt::format("the database has schema version {}, this program knows up to {}", found, present));
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
  // Switching to WAL does not wait for others as other statements do: one process at a time.
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
