#include "server/postgresql/schema.h"

#include <fmt/format.h>

#include <array>
#include <cstdint>

#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;
namespace {

/// A step of the schema, and the version of the oldest programs that can work with the tables after it. Servers of two
/// versions run side by side while the newer one is rolled out. So a step only adds what the programs before it can do
/// without, and what nothing uses any more is removed by a later one.
struct Migration {
  int oldest_program;
  const char* sql;
};

// Only append to this list; never change a released migration. Times are milliseconds since 1970 on the database's
// clock, messages are protobuf.
constexpr std::array kMigrations = {
    Migration{1, R"sql(
      CREATE FUNCTION now_ms() RETURNS bigint LANGUAGE sql VOLATILE AS
        'SELECT (extract(epoch FROM clock_timestamp()) * 1000)::bigint';
      CREATE TABLE change_counter (version bigint NOT NULL);
      INSERT INTO change_counter VALUES (0);
      CREATE TABLE jobs (
        seq bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
        id text NOT NULL UNIQUE,
        owner text NOT NULL,
        state text NOT NULL CHECK (state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')),
        created bigint NOT NULL,
        started bigint,
        finished bigint,
        expires bigint,
        retention bigint NOT NULL,
        attempt integer NOT NULL DEFAULT 0,
        strikes integer NOT NULL DEFAULT 0,
        deferrals integer NOT NULL DEFAULT 0,
        progressed boolean NOT NULL DEFAULT false,
        cancel_requested boolean NOT NULL DEFAULT false,
        losses text NOT NULL DEFAULT '',
        not_before bigint NOT NULL DEFAULT 0,
        rank bigint NOT NULL,
        lease_owner text,
        leased bigint,
        lease_until bigint,
        version bigint NOT NULL,
        bytes bigint NOT NULL,
        input bytea NOT NULL,
        parameters bytea NOT NULL,
        warnings bytea NOT NULL,
        progress bytea NOT NULL,
        result bytea,
        error bytea,
        idempotency_key text,
        request_digest text NOT NULL,
        UNIQUE (owner, idempotency_key)
      ) WITH (fillfactor = 80);
      CREATE INDEX jobs_by_state ON jobs (state, seq);
      CREATE INDEX jobs_by_version ON jobs (version);
      CREATE INDEX jobs_by_owner ON jobs (owner, seq);
      CREATE INDEX jobs_by_expiry ON jobs (expires) WHERE expires IS NOT NULL;
      CREATE INDEX queue ON jobs (owner, rank, seq) WHERE state = 'queued';
      CREATE INDEX running ON jobs (owner) WHERE state = 'running';

      CREATE TABLE usage (
        owner text PRIMARY KEY,
        queued bigint NOT NULL,
        bytes bigint NOT NULL,
        served bigint NOT NULL DEFAULT 0
      ) WITH (fillfactor = 50);
      CREATE FUNCTION count_usage() RETURNS trigger LANGUAGE plpgsql AS $$
        BEGIN
          IF TG_OP = 'INSERT' THEN
            INSERT INTO usage AS u (owner, queued, bytes) VALUES (new.owner, (new.state = 'queued')::int, new.bytes)
              ON CONFLICT (owner) DO UPDATE SET queued = u.queued + excluded.queued, bytes = u.bytes + excluded.bytes;
          ELSIF TG_OP = 'UPDATE' THEN
            UPDATE usage SET queued = queued + (new.state = 'queued')::int - (old.state = 'queued')::int,
                             bytes = bytes + new.bytes - old.bytes
              WHERE owner = new.owner;
          ELSE
            UPDATE usage SET queued = queued - (old.state = 'queued')::int, bytes = bytes - old.bytes
              WHERE owner = old.owner;
          END IF;
          RETURN NULL;
        END $$;
      CREATE TRIGGER count_new AFTER INSERT OR DELETE ON jobs FOR EACH ROW EXECUTE FUNCTION count_usage();
      CREATE TRIGGER count_changed AFTER UPDATE OF state, bytes ON jobs FOR EACH ROW
        WHEN (old.state <> new.state OR old.bytes <> new.bytes) EXECUTE FUNCTION count_usage();

      CREATE SEQUENCE blob_ids;
      CREATE TABLE files (
        job text NOT NULL,
        name text NOT NULL,
        bytes bigint NOT NULL,
        sha256 text NOT NULL,
        blob bigint NOT NULL,
        PRIMARY KEY (job, name)
      );
      CREATE TABLE chunks (blob bigint NOT NULL, number integer NOT NULL, bytes bytea NOT NULL, PRIMARY KEY (blob, number));
      ALTER TABLE chunks ALTER bytes SET STORAGE EXTERNAL;
      CREATE TABLE removed (blob bigint PRIMARY KEY);
      CREATE FUNCTION forget_file() RETURNS trigger LANGUAGE plpgsql AS $$
        BEGIN
          INSERT INTO removed VALUES (old.blob);
          RETURN NULL;
        END $$;
      CREATE TRIGGER forget_file AFTER DELETE ON files FOR EACH ROW EXECUTE FUNCTION forget_file();
      CREATE TRIGGER forget_former AFTER UPDATE OF blob ON files FOR EACH ROW
        WHEN (old.blob <> new.blob) EXECUTE FUNCTION forget_file();
      CREATE FUNCTION forget_files() RETURNS trigger LANGUAGE plpgsql AS $$
        BEGIN
          DELETE FROM files WHERE job = old.id;
          RETURN NULL;
        END $$;
      CREATE TRIGGER forget_files AFTER DELETE ON jobs FOR EACH ROW EXECUTE FUNCTION forget_files();

      CREATE TABLE workers (name text PRIMARY KEY, seen bigint NOT NULL, problem text NOT NULL);
      CREATE TABLE secrets (name text PRIMARY KEY, value text NOT NULL);
    )sql"},
    // Adds the start of the database that counted last: after a crash or a failover the counter leaves out the numbers
    // that may have been told and lost.
    Migration{1, R"sql(
      ALTER TABLE change_counter ADD COLUMN counted_since timestamptz NOT NULL DEFAULT pg_postmaster_start_time();
    )sql"},
    // Changes are numbered by a sequence under an advisory lock, because every change had to pass all versions of the
    // counter's row that a backup could still see. Programs before this one find the counter as a view. What a
    // statement deletes is counted once, and there are indexes for the jobs of a key in a state and for those that
    // wait.
    Migration{1, R"sql(
      CREATE TABLE counting (since timestamptz NOT NULL);
      INSERT INTO counting SELECT counted_since FROM change_counter;
      CREATE SEQUENCE change_numbers;
      SELECT setval('change_numbers', version + 1) FROM change_counter;
      CREATE FUNCTION count_change() RETURNS bigint LANGUAGE plpgsql AS $$
        DECLARE
          number bigint;
          started timestamptz := pg_postmaster_start_time();
        BEGIN
          PERFORM pg_advisory_xact_lock(x'636f756e74'::bigint);
          -- A commit that need not be durable may be told to others and then be lost with the database's machine. Its
          -- number must not come again, or they would take another change for one that they know.
          IF (SELECT since FROM counting) <> started THEN
            UPDATE counting SET since = started;
            PERFORM setval('change_numbers', nextval('change_numbers') + 1048576);
          END IF;
          number := nextval('change_numbers');
          PERFORM pg_notify('creased_changes', number::text);
          RETURN number;
        END $$;
      DROP TABLE change_counter;
      CREATE VIEW change_counter AS
        SELECT (SELECT coalesce(max(version), 0) FROM jobs) AS version, since AS counted_since FROM counting;
      CREATE FUNCTION count_change_of_view() RETURNS trigger LANGUAGE plpgsql AS $$
        BEGIN
          new.version := count_change();
          RETURN new;
        END $$;
      CREATE TRIGGER count_change INSTEAD OF UPDATE ON change_counter FOR EACH ROW
        EXECUTE FUNCTION count_change_of_view();

      CREATE OR REPLACE FUNCTION count_usage() RETURNS trigger LANGUAGE plpgsql AS $$
        BEGIN
          IF TG_OP = 'INSERT' THEN
            INSERT INTO usage AS u (owner, queued, bytes) VALUES (new.owner, (new.state = 'queued')::int, new.bytes)
              ON CONFLICT (owner) DO UPDATE SET queued = u.queued + excluded.queued, bytes = u.bytes + excluded.bytes;
          ELSE
            UPDATE usage SET queued = queued + (new.state = 'queued')::int - (old.state = 'queued')::int,
                             bytes = bytes + new.bytes - old.bytes,
                             served = CASE WHEN new.state = 'running' THEN new.version ELSE served END
              WHERE owner = new.owner;
          END IF;
          RETURN NULL;
        END $$;
      CREATE FUNCTION count_removed() RETURNS trigger LANGUAGE plpgsql AS $$
        BEGIN
          UPDATE usage SET queued = usage.queued - sums.queued, bytes = usage.bytes - sums.bytes
            FROM (SELECT owner, count(*) FILTER (WHERE state = 'queued') AS queued, sum(bytes) AS bytes
                    FROM gone GROUP BY owner ORDER BY owner) AS sums
            WHERE usage.owner = sums.owner;
          RETURN NULL;
        END $$;
      DROP TRIGGER count_new ON jobs;
      CREATE TRIGGER count_new AFTER INSERT ON jobs FOR EACH ROW EXECUTE FUNCTION count_usage();
      CREATE TRIGGER count_removed AFTER DELETE ON jobs REFERENCING OLD TABLE AS gone
        FOR EACH STATEMENT EXECUTE FUNCTION count_removed();
      CREATE FUNCTION forget_files_of_all() RETURNS trigger LANGUAGE plpgsql AS $$
        BEGIN
          DELETE FROM files WHERE job = ANY (ARRAY (SELECT id FROM gone));
          RETURN NULL;
        END $$;
      DROP TRIGGER forget_files ON jobs;
      CREATE TRIGGER forget_files AFTER DELETE ON jobs REFERENCING OLD TABLE AS gone
        FOR EACH STATEMENT EXECUTE FUNCTION forget_files_of_all();
      DROP FUNCTION forget_files;
      CREATE FUNCTION forget_all() RETURNS trigger LANGUAGE plpgsql AS $$
        BEGIN
          INSERT INTO removed SELECT blob FROM gone;
          RETURN NULL;
        END $$;
      DROP TRIGGER forget_file ON files;
      CREATE TRIGGER forget_file AFTER DELETE ON files REFERENCING OLD TABLE AS gone
        FOR EACH STATEMENT EXECUTE FUNCTION forget_all();

      CREATE INDEX jobs_by_owner_and_state ON jobs (owner, state, seq);
      CREATE INDEX deferred ON jobs (not_before) WHERE state = 'queued' AND not_before > 0;
    )sql"},
};

// Of advisory locks in this database: "crease" in ASCII.
constexpr std::int64_t kMigrationLock = 0x637265617365;

void check_version(int found, int oldest_program) {
  constexpr int kPresent = static_cast<int>(kMigrations.size());
  if (found <= kPresent || oldest_program <= kPresent) return;
  throw crease::Error(
      code::kStoreUnavailable,
      fmt::format("the database has schema version {}, which programs with version {} or later can use; "
                  "this one has version {}",
                  found, oldest_program, kPresent));
}

}  // namespace

void prepare_tables(pqxx::connection& connection) {
  pqxx::work transaction(connection);
  transaction.exec_params("SELECT pg_advisory_xact_lock($1)", kMigrationLock);
  transaction.exec(
      "CREATE TABLE IF NOT EXISTS schema_version (version integer NOT NULL, oldest_program integer NOT NULL)");
  const auto row = transaction.exec("SELECT version, oldest_program FROM schema_version");
  int version = row.empty() ? 0 : row[0][0].as<int>();
  check_version(version, row.empty() ? 0 : row[0][1].as<int>());
  if (row.empty()) transaction.exec("INSERT INTO schema_version VALUES (0, 0)");
  for (; version < static_cast<int>(kMigrations.size()); ++version) {
    const Migration& next = kMigrations.at(static_cast<std::size_t>(version));
    transaction.exec(next.sql);
    transaction.exec_params("UPDATE schema_version SET version = $1, oldest_program = $2", version + 1,
                            next.oldest_program);
  }
  transaction.commit();
}

}  // namespace creased
