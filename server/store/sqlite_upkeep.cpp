#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <fstream>

#include "crease/v1/result.pb.h"
#include "proto/convert.h"
#include "server/base/durable_file.h"
#include "server/store/job_facts.h"
#include "server/store/job_row.h"
#include "server/store/sqlite_store.h"

namespace creased {
namespace code = crease::code;
namespace v1 = crease::v1;
namespace {

constexpr std::chrono::hours kLeftoverAge{1};
constexpr std::int64_t kLeastStepMs = 60'000;

std::string boot_id() {
  std::ifstream file("/proc/sys/kernel/random/boot_id");
  std::string id;
  std::getline(file, id);
  return id;
}

template <class Message>
bool read_message(const std::filesystem::path& path, Message& message) {
  std::ifstream file(path, std::ios::binary);
  return file.is_open() && message.ParseFromIstream(&file);
}

FileRecord record_of(const std::filesystem::path& path) {
  const std::string bytes = read_whole(path);
  return {path.filename().string(), bytes.size(), crease::sha256_hex(bytes)};
}

}  // namespace

bool SqliteStore::delete_row(std::string_view id, const Owner& owner) {
  return guarded([&] {
    Writer::Transaction transaction(durable_writer_);
    count_change(*transaction);
    const int rows =
        Query(*transaction, "DELETE FROM jobs WHERE id = ?1 AND (?2 IS NULL OR owner = ?2)", id, owner).run();
    if (rows > 0) transaction.commit();
    return rows > 0;
  });
}

bool SqliteStore::remove(std::string_view id, const Owner& owner) {
  bool removed = false;
  try {
    removed = delete_row(id, owner);
  } catch (const crease::Error& error) {
    // Removing a job frees space, but needs some first.
    if (error.code() != code::kStorageFull || !files_.free_ballast()) throw;
    removed = delete_row(id, owner);
  }
  if (!removed) return false;
  discard_removed();
  durable_writer_.empty_log();
  files_.take_ballast();
  spdlog::info("job {} removed", id);
  return true;
}

/// How far the wall clock was set since the last call in the life of this machine, by any process; milliseconds.
std::int64_t SqliteStore::clock_step(Connection& connection) {
  const std::int64_t offset = clock_offset_ms();
  const std::string boot = boot_id();
  std::optional<std::int64_t> former;
  {
    Query row(connection, "SELECT offset FROM clock WHERE boot = ?", boot);
    if (row.next()) former = row.integer(0);
  }
  if (former && std::abs(offset - *former) < kLeastStepMs) return 0;
  Query(connection, "DELETE FROM clock").run();
  Query(connection, "INSERT INTO clock VALUES (?, ?)", boot, offset).run();
  return former ? offset - *former : 0;
}

/// Moves the times of expiry with the wall clock when that was set, so that no job expires early or late.
void SqliteStore::move_expiry() {
  const std::int64_t now = now_ms(), last = last_expiry_ms_.exchange(now);
  std::int64_t step = 0;
  {
    // Nothing is written as long as nobody touches the clock.
    ReaderPool::Loan reader(readers_);
    Query row(*reader, "SELECT offset FROM clock WHERE boot = ?", boot_id());
    const bool same = row.next() && std::abs(clock_offset_ms() - row.integer(0)) < kLeastStepMs;
    // This is called every second: a clock that misses minutes and shows it nowhere else was set, too.
    if (same && (last == 0 || now - last < kLeastStepMs)) return;
    if (same) step = now - last;
  }
  Writer::Transaction transaction(durable_writer_);
  if (const std::int64_t by_offset = clock_step(*transaction); by_offset != 0) step = by_offset;
  if (step != 0) {
    Query(*transaction, "UPDATE jobs SET expires = expires + ? WHERE expires IS NOT NULL", step).run();
    spdlog::warn("the clock was set by {} s; the times at which jobs expire move with it", step / 1000);
  }
  transaction.commit();
}

std::vector<std::string> SqliteStore::remove_expired() {
  std::vector<std::string> ids = guarded([&] {
    move_expiry();
    std::vector<std::string> expired;
    {
      ReaderPool::Loan reader(readers_);
      Query row(*reader, "SELECT 1 FROM jobs WHERE expires <= ? LIMIT 1", now_ms());
      if (!row.next()) return expired;
    }
    Writer::Transaction transaction(durable_writer_);
    {
      Query rows(*transaction, "DELETE FROM jobs WHERE expires <= ? RETURNING id", now_ms());
      while (rows.next()) expired.push_back(rows.text(0));
    }
    count_change(*transaction);
    transaction.commit();
    return expired;
  });
  for (const std::string& id : ids) spdlog::info("job {} removed: its retention time was over", id);
  discard_removed();
  if (!ids.empty()) guarded([&] { durable_writer_.empty_log(); });
  files_.take_ballast();
  return ids;
}

void SqliteStore::clean_leftovers() {
  std::unordered_set<std::string> known;
  guarded([&] {
    ReaderPool::Loan reader(readers_);
    Query rows(*reader, "SELECT id FROM jobs");
    while (rows.next()) known.insert(rows.text(0));
  });
  files_.clean_leftovers(known, kLeftoverAge);
}

/// Deletes each row after its files, so that another process can finish what a killed one has left. While the row is
/// there no new job gets the id, and only who finds it there, alone, touches the files: another may have finished the
/// removal, and a new job have taken the id, since the ids were listed.
void SqliteStore::discard_removed() {
  guarded([&] {
    std::vector<std::string> ids;
    {
      ReaderPool::Loan reader(readers_);
      Query rows(*reader, "SELECT id FROM removed");
      while (rows.next()) ids.push_back(rows.text(0));
    }
    for (const std::string& id : ids) {
      Writer::Transaction transaction(durable_writer_);
      if (Query(*transaction, "DELETE FROM removed WHERE id = ?", id).run() == 0) continue;
      files_.discard(id);
      transaction.commit();
    }
  });
}

void SqliteStore::probe_database() {
  with_store_errors([&] {
    Writer::Transaction transaction(durable_writer_);
    Query(*transaction, "UPDATE change_counter SET version = version").run();
    transaction.commit();
  });
}

std::uint64_t SqliteStore::used_bytes() {
  return guarded([&] {
    ReaderPool::Loan reader(readers_);
    return usage_of(*reader, std::nullopt).bytes;
  });
}

void SqliteStore::note_worker(std::string_view name, std::string_view problem) {
  guarded([&] {
    constexpr std::int64_t kForgetMs = 3'600'000;
    Writer::Transaction transaction(writer_);
    Query(*transaction, "INSERT OR REPLACE INTO workers VALUES (?, ?, ?)", name, now_ms(), problem).run();
    Query(*transaction, "DELETE FROM workers WHERE abs(seen - ?) > ?", now_ms(), kForgetMs).run();
    transaction.commit();
  });
}

std::vector<WorkerHealth> SqliteStore::workers() {
  return guarded([&] {
    ReaderPool::Loan reader(readers_);
    Query rows(*reader, "SELECT name, seen, problem FROM workers");
    std::vector<WorkerHealth> all;
    const std::int64_t now = now_ms();
    while (rows.next()) {
      all.push_back({rows.text(0), std::chrono::milliseconds(std::abs(now - rows.integer(1))), rows.text(2)});
    }
    return all;
  });
}

std::vector<std::string> SqliteStore::busy_owners() {
  return guarded([&] {
    ReaderPool::Loan reader(readers_);
    Query rows(*reader, "SELECT DISTINCT owner FROM jobs WHERE state IN ('queued', 'running')");
    std::vector<std::string> owners;
    while (rows.next()) owners.push_back(rows.text(0));
    return owners;
  });
}

void SqliteStore::cancel_all(const std::string& owner) {
  std::vector<std::string> ids;
  guarded([&] {
    ReaderPool::Loan reader(readers_);
    Query rows(*reader, "SELECT id FROM jobs WHERE owner = ? AND state IN ('queued', 'running')", owner);
    while (rows.next()) ids.push_back(rows.text(0));
  });
  for (const std::string& id : ids) cancel(id, owner);
}

/// Makes a row again for each folder of an accepted job that the database does not know: after a loss of the database,
/// of a part of it, or of its log, and for submissions that were interrupted just before their end.
void SqliteStore::adopt_folders() {
  for (const std::string& id : files_.ids()) {
    if (version_of(id) != 0) continue;
    v1::StoredJob accepted;
    v1::Report report;
    const bool recorded = read_message(files_.path(id, file::kAccepted), accepted) && accepted.job().id() == id;
    if (!recorded && read_message(files_.path(id, file::kReport), report) && report.id() == id) {
      // A job of a version that kept no records. Its owner is not known.
      *accepted.mutable_job()->mutable_input() = report.input();
      *accepted.mutable_job()->mutable_parameters() = report.parameters();
      accepted.set_created_ms(now_ms());
    } else if (!recorded) {
      spdlog::warn("the folder of job {} has no record and stays as it is", id);
      continue;
    }
    adopt(id, accepted);
  }
}

std::vector<FileRecord> SqliteStore::whole_files(const std::string& id) const {
  v1::StoredEnd end;
  if (!read_message(files_.path(id, file::kEnd), end)) return {};
  std::vector<FileRecord> whole;
  for (const auto& then : end.files()) {
    const auto path = files_.path(id, then.name());
    if (!std::filesystem::exists(path)) return {};
    FileRecord now = record_of(path);
    if (now.bytes != then.bytes() || now.sha256 != then.sha256()) return {};
    whole.push_back(std::move(now));
  }
  return whole;
}

void SqliteStore::adopt(const std::string& id, const v1::StoredJob& accepted) {
  guarded([&] {
    v1::Report report;
    const std::vector<FileRecord> files = whole_files(id);
    const bool done = !files.empty() && read_message(files_.path(id, file::kReport), report) && report.id() == id;
    const v1::Job& job = accepted.job();
    v1::Progress progress;
    progress.set_stage(done ? "done" : "queued");
    progress.set_fraction(done ? 1 : 0);
    progress.set_sweeps(job.parameters().sweeps());
    const std::string input = job.input().SerializeAsString(), parameters = job.parameters().SerializeAsString(),
                      warnings = warnings_bytes(done ? report.warnings() : job.warnings()),
                      progress_bytes = progress.SerializeAsString(), result = report.result().SerializeAsString();
    const auto key =
        accepted.idempotency_key().empty() ? std::nullopt : std::optional<std::string>(accepted.idempotency_key());
    const auto retention = retention_ms(job.parameters());
    Writer::Transaction transaction(durable_writer_);
    count_change(*transaction);
    Query(*transaction,
          "INSERT INTO jobs (id, owner, state, created, retention, bytes, version, input, parameters, warnings,"
          " progress, idempotency_key, request_digest, rank)"
          " VALUES (?, ?, ?, ?, ?, ?, (SELECT version FROM change_counter), ?, ?, ?, ?, ?, ?, ?)",
          id, accepted.owner(), name_of(done ? JobState::kSucceeded : JobState::kQueued), accepted.created_ms(),
          retention, files_.bytes(id), Blob{input}, Blob{parameters}, Blob{warnings}, Blob{progress_bytes}, key,
          accepted.request_digest(), accepted.created_ms())
        .run();
    if (done) {
      Query(*transaction,
            "UPDATE jobs SET started = ?1, finished = ?1, expires = ?1 + retention, attempt = 1, result = ?2"
            " WHERE id = ?3",
            now_ms(), Blob{result}, id)
          .run();
      for (const FileRecord& file : files) {
        Query(*transaction, "INSERT OR REPLACE INTO files VALUES (?, ?, ?, ?)", id, file.name,
              static_cast<std::int64_t>(file.bytes), file.sha256)
            .run();
      }
    }
    transaction.commit();
    spdlog::warn("job {} was not in the database and is {} again", id, done ? "kept" : "queued");
  });
}

}  // namespace creased
