#include "server/store/sqlite_store.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <random>

#include "crease/v1/stored.pb.h"
#include "server/base/durable_file.h"
#include "server/base/failure.h"
#include "server/jobs/needs.h"
#include "server/store/job_facts.h"
#include "server/store/job_row.h"
#include "server/store/recovery.h"
#include "server/store/sqlite_schema.h"

namespace creased {
namespace code = crease::code;
namespace v1 = crease::v1;
namespace {

constexpr std::size_t kReaders = 4;
std::filesystem::path prepared(const StoreOptions& options, const JobFiles& files) {
  const auto database = options.data_dir / "creased.db";
  refuse_lost_database(database, files, options);
  if (options.recover) mend_database(database, files);
  prepare_database(database);
  return database;
}

std::optional<v1::Job> job_of_key(Connection& connection, const NewJob& request) {
  if (request.idempotency_key.empty()) return std::nullopt;
  static const std::string sql = select_jobs("WHERE owner = ? AND idempotency_key = ?");
  Query known(connection, sql, request.owner, request.idempotency_key);
  if (!known.next()) return std::nullopt;
  v1::Job job = read_job(known);
  Query same(connection, "SELECT 1 FROM jobs WHERE id = ? AND request_digest = ?", job.id(), request.request_digest);
  if (!same.next()) {
    throw_conflict(job.id());
  }
  return job;
}

// Condition on the owner; ?2 is bound to an Owner.
constexpr std::string_view kOfOwner = "(?2 IS NULL OR owner = ?2)";

std::uint64_t size_of(const std::filesystem::path& path) {
  std::error_code failed;
  const auto bytes = std::filesystem::file_size(path, failed);
  return failed ? 0 : bytes;
}

}  // namespace

SqliteStore::SqliteStore(const StoreOptions& options)
    : DatabaseStore(options),
      database_(prepared(options, files_)),
      readers_(database_, kReaders),
      writer_(database_, Connection::Role::kWriter),
      durable_writer_(database_, Connection::Role::kDurable) {
  // A first write shows what cannot be written, and removals that were interrupted are finished.
  SqliteStore::probe_database();
  discard_removed();
  if (options.recover) adopt_folders();
  clean_leftovers();
  files_.take_ballast();
}

bool SqliteStore::is_being_removed(const std::string& id) {
  ReaderPool::Loan reader(readers_);
  return Query(*reader, "SELECT 1 FROM removed WHERE id = ?", id).next();
}

std::string SqliteStore::reserve_id(const std::string& fingerprint) {
  constexpr std::uint32_t kSuffixes = 1U << 24U;
  std::random_device random;
  std::string id = fingerprint;
  while (version_of(id) != 0 || is_being_removed(id) || !files_.reserve(id))
    id = fmt::format("{}-{:06x}", fingerprint, random() % kSuffixes);
  return id;
}

v1::Job SqliteStore::submit(const NewJob& request, bool& created) {
  return guarded([&] {
    const UploadGuard guard{request};
    created = false;
    {
      ReaderPool::Loan reader(readers_);
      if (auto known = job_of_key(*reader, request)) return *known;
    }
    const std::string id = reserve_id(request.fingerprint);
    try {
      write_accepted(request, id);
      if (!request.weights.empty()) files_.adopt(id, request.weights, file::kWeights);
      files_.adopt(id, request.upload, file::kUpload);
      v1::Job job = insert(request, id, created);
      if (created) {
        spdlog::info("job {} queued: {} bytes, {} faces", id, request.input.bytes(), request.input.faces());
      } else {
        files_.discard(id);
      }
      return job;
    } catch (...) {
      files_.discard(id);
      throw;
    }
  });
}

/// Keeps what was accepted beside the upload. It need not be on the disk: it is for the day when the database is lost.
void SqliteStore::write_accepted(const NewJob& request, const std::string& id) const {
  v1::StoredJob accepted;
  accepted.mutable_job()->set_id(id);
  *accepted.mutable_job()->mutable_input() = request.input;
  *accepted.mutable_job()->mutable_parameters() = request.parameters;
  *accepted.mutable_job()->mutable_warnings() = {request.warnings.begin(), request.warnings.end()};
  accepted.set_owner(request.owner);
  accepted.set_idempotency_key(request.idempotency_key);
  accepted.set_request_digest(request.request_digest);
  accepted.set_created_ms(now_ms());
  ReplacingFile file(files_.path(id, file::kAccepted), "part");
  if (!write_all(file.descriptor(), accepted.SerializeAsString())) throw file_failure("write", file.path());
  file.commit(Durability::kNone);
}

/// Keeps what the job ended with, for the same day. Without it the job would run again.
void SqliteStore::write_end(const std::string& id, const std::vector<FileRecord>& files) const {
  v1::StoredEnd end;
  for (const FileRecord& one : files) {
    v1::StoredEnd::File& file = *end.add_files();
    file.set_name(one.name);
    file.set_bytes(one.bytes);
    file.set_sha256(one.sha256);
  }
  ReplacingFile file(files_.path(id, file::kEnd), "part");
  if (!write_all(file.descriptor(), end.SerializeAsString())) throw file_failure("write", file.path());
  file.commit(Durability::kNone);
}

/// Returns the new job as it is before any worker sees it, or the one that the request's key has already.
v1::Job SqliteStore::insert(const NewJob& request, const std::string& id, bool& created) {
  const std::string input = request.input.SerializeAsString(), parameters = request.parameters.SerializeAsString(),
                    warnings = warnings_bytes({request.warnings.begin(), request.warnings.end()}),
                    progress_bytes = first_progress(request.parameters).SerializeAsString();
  const Needs needs = needs_of(request.input, request.parameters);
  const std::uint64_t bytes = size_of(request.upload) + size_of(request.weights) + needs.disk_bytes;
  const std::int64_t now = now_ms();
  const auto key = request.idempotency_key.empty() ? std::nullopt : std::optional<std::string>(request.idempotency_key);

  Writer::Transaction transaction(durable_writer_);
  if (auto known = job_of_key(*transaction, request)) return *known;
  check_room(*transaction, request, bytes);
  count_change(*transaction);
  Query(*transaction,
        "INSERT INTO jobs (id, owner, state, created, retention, bytes, version, input, parameters, warnings, progress,"
        " idempotency_key, request_digest, rank)"
        " VALUES (?, ?, 'queued', ?, ?, ?, (SELECT version FROM change_counter), ?, ?, ?, ?, ?, ?, ?)",
        id, request.owner, now, retention_ms(request.parameters), static_cast<std::int64_t>(bytes), Blob{input},
        Blob{parameters}, Blob{warnings}, Blob{progress_bytes}, key, request.request_digest, now + needs.work.count())
      .run();
  v1::Job job = job_of_id(*transaction, id, std::nullopt).value();
  transaction.commit();
  created = true;
  return job;
}

void SqliteStore::check_room(Connection& connection, const NewJob& request, std::uint64_t bytes) const {
  const Usage all = usage_of(connection, std::nullopt), own = usage_of(connection, request.owner);
  check_limits(all, own, options_, request.owner_limits, bytes);
  const auto room = files_.room();
  if (room.free < bytes + room.reserve()) {
    throw crease::Error(code::kStorageFull, fmt::format("the job may need {}, but the disk has only {} left",
                                                        megabytes(bytes), megabytes(room.free)));
  }
}

std::optional<v1::Job> SqliteStore::find(std::string_view id, const Owner& owner) {
  return guarded([&] {
    ReaderPool::Loan reader(readers_);
    return job_of_id(*reader, id, owner);
  });
}

JobPage SqliteStore::list(std::string_view state, std::size_t limit, std::string_view cursor, const Owner& owner) {
  check_state(state);
  const std::int64_t before = parse_cursor(cursor);
  const auto rows_wanted = static_cast<std::int64_t>(limit) + 1;
  const std::string sql =
      select_jobs(fmt::format("WHERE seq < ?1 AND {} AND {} ORDER BY seq DESC LIMIT ?4",
                              owner ? "owner = ?2" : "?2 IS NULL", state.empty() ? "?3 = ''" : "state = ?3"));
  return guarded([&] {
    ReaderPool::Loan reader(readers_);
    Query rows(*reader, sql, before, owner, state, rows_wanted);
    std::vector<ListedJob> found;
    while (rows.next()) found.push_back({job_seq(rows), read_job(rows)});
    return page_of(std::move(found), limit);
  });
}

std::optional<v1::Job> SqliteStore::cancel(std::string_view id, const Owner& owner) {
  return guarded([&]() -> std::optional<v1::Job> {
    Writer::Transaction transaction(durable_writer_);
    auto job = job_of_id(*transaction, id, owner);
    if (!job) return std::nullopt;
    Life life;
    {
      Query row(*transaction, fmt::format("SELECT {}, lease_until FROM jobs WHERE id = ?", life_columns()), id);
      row.next();
      life = read_life(row, 0);
      if (life.state == JobState::kRunning && row.integer(kLifeColumns) <= now_ms()) life.state = JobState::kQueued;
    }
    const Life after = cancelled(life);
    if (after == life) return job;
    take(*transaction, job->id(), job->progress().SerializeAsString(), {after});
    job = job_of_id(*transaction, id);
    transaction.commit();
    if (is_terminal(after.state)) {
      spdlog::info("job {} cancelled before its end, in attempt {}", id, job->attempt());
    }
    return job;
  });
}

std::uint64_t SqliteStore::last_version() {
  return guarded([&] {
    ReaderPool::Loan reader(readers_);
    Query row(*reader, "SELECT version FROM change_counter");
    row.next();
    return static_cast<std::uint64_t>(row.integer(0));
  });
}

std::vector<JobChange> SqliteStore::changes_since(std::uint64_t since) {
  return guarded([&] {
    ReaderPool::Loan reader(readers_);
    Query rows(*reader, "SELECT id, version, state FROM jobs WHERE version > ? ORDER BY version",
               static_cast<std::int64_t>(since));
    std::vector<JobChange> changes;
    while (rows.next()) changes.push_back({rows.text(0), static_cast<std::uint64_t>(rows.integer(1)), rows.text(2)});
    return changes;
  });
}

std::uint64_t SqliteStore::version_of(std::string_view id) {
  return guarded([&] {
    ReaderPool::Loan reader(readers_);
    Query row(*reader, "SELECT version FROM jobs WHERE id = ?", id);
    return row.next() ? static_cast<std::uint64_t>(row.integer(0)) : 0;
  });
}

std::vector<std::string> SqliteStore::missing(const std::vector<std::string>& ids) {
  return guarded([&] {
    ReaderPool::Loan reader(readers_);
    std::vector<std::string> gone;
    std::ranges::copy_if(ids, std::back_inserter(gone), [&](const std::string& id) {
      return !Query(*reader, "SELECT 1 FROM jobs WHERE id = ?", id).next();
    });
    return gone;
  });
}

std::size_t SqliteStore::queued() {
  return guarded([&] {
    ReaderPool::Loan reader(readers_);
    return usage_of(*reader, std::nullopt).queued;
  });
}

std::chrono::milliseconds SqliteStore::longest_wait() {
  return guarded([&] {
    ReaderPool::Loan reader(readers_);
    Query row(*reader, "SELECT created FROM jobs WHERE state = 'queued' ORDER BY seq LIMIT 1");
    return std::chrono::milliseconds(row.next() ? std::max<std::int64_t>(0, now_ms() - row.integer(0)) : 0);
  });
}

std::shared_ptr<const OpenFile> SqliteStore::open(std::string_view id, std::string_view name) {
  return open_file(files_.path(id, name));
}

std::filesystem::path SqliteStore::working_path(const Claim& claim, std::string_view name) const {
  return files_.path(claim.job_id, name);
}

}  // namespace creased
