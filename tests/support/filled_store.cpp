#include "tests/support/filled_store.h"

#include <fmt/format.h>

#include <pqxx/pqxx>
#include <stdexcept>

#include "tests/support/patience.h"

namespace crease::test {
namespace {

// Its triggers would count each row for itself.
constexpr const char* kFill = R"sql(
  ALTER TABLE jobs DISABLE TRIGGER USER;
  CREATE TEMPORARY TABLE model AS SELECT * FROM jobs WHERE state = 'succeeded' LIMIT 1;
  INSERT INTO jobs (id, owner, state, created, started, finished, expires, retention, attempt, rank, version, bytes,
                    input, parameters, warnings, progress, result, request_digest)
    SELECT lpad(to_hex(n), 16, '0'), CASE n % 2 WHEN 0 THEN '{0}' ELSE '{1}' END,
           CASE n % 2 WHEN 0 THEN 'succeeded' ELSE 'failed' END, created, started, finished, now_ms() + 86400000, 86400000,
           1, rank, nextval('change_numbers'), bytes, input, parameters, warnings, progress, result, request_digest
      FROM model, generate_series(1, {2}) AS n;
  CREATE TEMPORARY TABLE contents AS
    SELECT name, bytes, sha256, blob AS of_model, lpad(to_hex(n), 16, '0') AS job, nextval('blob_ids') AS blob
      FROM files, generate_series(1, {2}) AS n WHERE job = (SELECT id FROM model);
  INSERT INTO files SELECT job, name, bytes, sha256, blob FROM contents;
  INSERT INTO chunks SELECT contents.blob, number, chunks.bytes FROM contents JOIN chunks ON chunks.blob = of_model;
  DROP TABLE contents, model;
  INSERT INTO usage AS u SELECT owner, 0, sum(bytes) FROM jobs GROUP BY owner
    ON CONFLICT (owner) DO UPDATE SET bytes = excluded.bytes;
  ALTER TABLE jobs ENABLE TRIGGER USER;
)sql";

std::int64_t statistic(const std::string& url, const std::string& sql) {
  pqxx::connection connection(url);
  const bool alone = eventually([&] {
    return pqxx::nontransaction(connection)
               .exec1(
                   "SELECT count(*) FROM pg_stat_activity WHERE datname = current_database()"
                   " AND backend_type = 'client backend' AND pid <> pg_backend_pid()")[0]
               .as<int>() == 0;
  });
  if (!alone) throw std::runtime_error("other sessions do not end");
  return pqxx::nontransaction(connection).exec1(sql)[0].as<std::int64_t>();
}

}  // namespace

void fill_with_ended_jobs(const std::string& url, std::int64_t count) {
  pqxx::connection connection(url);
  pqxx::work work(connection);
  work.exec(fmt::format(kFill, kLuckyOwner, kUnluckyOwner, count));
  work.commit();
  pqxx::nontransaction(connection).exec("VACUUM ANALYZE");
}

std::string id_of_ended_job(std::int64_t number) { return fmt::format("{:016x}", number); }

std::int64_t rows_read(const std::string& url) {
  return statistic(url, "SELECT sum(seq_tup_read + coalesce(idx_tup_fetch, 0)) FROM pg_stat_user_tables");
}

std::int64_t rows_rewritten(const std::string& url, const std::string& table) {
  return statistic(url, "SELECT n_tup_upd FROM pg_stat_user_tables WHERE relname = '" + table + "'");
}

}  // namespace crease::test
