#include "server/store/recovery.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/store/job_row.h"
#include "server/store/sqlite_schema.h"

namespace creased {
namespace code = crease::code;
namespace fs = std::filesystem;
namespace {

constexpr int kCopyPatienceMs = 10'000;

bool is_missing(const fs::path& database) {
  std::error_code failed;
  const auto bytes = fs::file_size(database, failed);
  return failed || bytes == 0;
}

/// What is wrong with a database; empty when it is sound. Errors of opening or locking it are thrown.
std::string damage_of(const fs::path& path) {
  try {
    SQLite::Database database(path.string(), SQLite::OPEN_READWRITE, kCopyPatienceMs);
    const std::string found = database.execAndGet("PRAGMA quick_check(1)").getString();
    return found == "ok" ? std::string() : found;
  } catch (const SQLite::Exception& error) {
    constexpr int kCorrupt = 11, kNotADatabase = 26;
    if (error.getErrorCode() != kCorrupt && error.getErrorCode() != kNotADatabase) throw;
    return error.what();
  }
}

/// Runs a statement on what may be damaged. Returns whether that went well.
template <class... Args>
bool try_run(SQLite::Database& database, const char* sql, const Args&... args) {
  try {
    SQLite::Statement statement(database, sql);
    int place = 0;
    (statement.bind(++place, args), ...);
    return statement.exec() > 0;
  } catch (const SQLite::Exception&) {
    return false;
  }
}

}  // namespace

void refuse_lost_database(const fs::path& database, const JobFiles& files, const StoreOptions& options) {
  if (!is_missing(database)) return;
  const auto ids = files.ids();
  if (ids.empty() || (options.recover && options.orphans == Orphans::kAdopt)) return;
  if (options.recover && options.orphans == Orphans::kDiscard) {
    for (const std::string& id : ids) files.discard(id);
    spdlog::warn("the database {} was missing; the files of {} jobs were discarded", database.string(), ids.size());
    return;
  }
  throw crease::Error(code::kStoreUnavailable,
                      fmt::format("the database {} is missing, but there are files of {} jobs; put it back, or start "
                                  "with --orphans adopt to make it anew from the files, or --orphans discard to remove "
                                  "them",
                                  database.string(), ids.size()));
}

void mend_database(const fs::path& path, const JobFiles& files) {
  if (is_missing(path)) return;
  const std::string damage = damage_of(path);
  if (damage.empty()) return;
  const std::string aside = fmt::format("{}.damaged-{}", path.string(), now_ms());
  spdlog::error("the database {} is damaged ({}); it is kept as {}", path.string(), damage, aside);
  for (const std::string_view part : {"-wal", ""}) {
    const std::string from = fmt::format("{}{}", path.string(), part);
    if (fs::exists(from)) fs::rename(from, fmt::format("{}{}", aside, part));
  }
  fs::remove(path.string() + "-shm");
  prepare_database(path);

  SQLite::Database database(path.string(), SQLite::OPEN_READWRITE, kCopyPatienceMs);
  std::size_t copied = 0;
  const auto ids = files.ids();
  try_run(database, "ATTACH ? AS old", aside);
  for (const std::string& id : ids) {
    copied += try_run(database, "INSERT INTO jobs SELECT * FROM old.jobs WHERE id = ?", id) ? 1 : 0;
    try_run(database, "INSERT INTO files SELECT * FROM old.files WHERE job = ?", id);
  }
  try_run(database, "INSERT INTO removed SELECT * FROM old.removed");
  try_run(database, "UPDATE change_counter SET version = max((SELECT version FROM old.change_counter), version)");
  try_run(database, "UPDATE change_counter SET version = max(version, (SELECT coalesce(max(version), 0) FROM jobs))");
  spdlog::error("{} of {} jobs were read from the damaged database; others are made again from their files", copied,
                ids.size());
}

}  // namespace creased
