#include "server/store/sqlite_store.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <random>

#include "server/store/failure.h"
#include "server/store/job_row.h"
#include "server/store/sqlite_schema.h"

namespace creased {
namespace v1 = crease::v1;
namespace {

constexpr std::size_t kReaders = 4;
constexpr std::string_view kUpload = "upload";
constexpr std::chrono::hours kLeftoverAge{1};
constexpr std::array<std::string_view, 5> kStates = {"queued", "running", "succeeded", "failed", "cancelled"};

std::filesystem::path prepared(std::filesystem::path database) {
  prepare_database(database);
  return database;
}

/// Removes the files of a submission unless they have been moved away.
struct UploadGuard {
  const NewJob& job;
  ~UploadGuard() {
    std::error_code ignored;
    std::filesystem::remove(job.upload, ignored);
    std::filesystem::remove(job.weights, ignored);
  }
};

std::optional<v1::Job> job_of_key(Connection& connection, const NewJob& request) {
  if (request.idempotency_key.empty()) return std::nullopt;
  static const std::string sql = select_jobs("WHERE idempotency_key = ?");
  Query known(connection, sql, request.idempotency_key);
  if (!known.next()) return std::nullopt;
  v1::Job job = read_job(known);
  Query same(connection, "SELECT 1 FROM jobs WHERE id = ? AND request_digest = ?", job.id(), request.request_digest);
  if (!same.next()) {
    throw crease::Error(code::kIdempotencyConflict,
                        fmt::format("the key came with another request before, which made job {}", job.id()));
  }
  return job;
}

std::optional<v1::Job> job_of_id(Connection& connection, std::string_view id) {
  static const std::string sql = select_jobs("WHERE id = ?");
  Query row(connection, sql, id);
  if (!row.next()) return std::nullopt;
  return read_job(row);
}

std::size_t count_queued(Connection& connection) {
  Query row(connection, "SELECT count(*) FROM jobs WHERE state = 'queued'");
  row.next();
  return static_cast<std::size_t>(row.integer(0));
}

constexpr std::size_t kCursorDigits = 16;

std::string cursor_after(std::int64_t seq) { return fmt::format("{:016x}", seq); }

std::int64_t parse_cursor(std::string_view cursor) {
  if (cursor.empty()) return std::numeric_limits<std::int64_t>::max();
  std::int64_t seq = 0;
  const auto [end, failure] = std::from_chars(cursor.data(), cursor.data() + cursor.size(), seq, 16);
  if (failure != std::errc() || end != cursor.data() + cursor.size() || cursor.size() != kCursorDigits || seq < 1) {
    throw crease::Error::parameter(crease::code::kParameterInvalid, "cursor", std::string(cursor),
                                   "the next_cursor of an earlier page");
  }
  return seq;
}

void check_state(std::string_view state) {
  if (state.empty() || std::ranges::find(kStates, state) != kStates.end()) return;
  throw crease::Error::parameter(crease::code::kParameterInvalid, "state", std::string(state),
                                 fmt::format("one of {}", fmt::join(kStates, ", ")));
}

}  // namespace

SqliteStore::SqliteStore(const StoreOptions& options)
    : files_(options.data_dir),
      database_(prepared(options.data_dir / "creased.db")),
      max_queued_(options.max_queued),
      max_attempts_(options.max_attempts),
      readers_(database_, kReaders),
      writer_(database_, Connection::Role::kWriter),
      durable_writer_(database_, Connection::Role::kDurable) {
  std::unordered_set<std::string> known;
  {
    ReaderPool::Loan reader(readers_);
    Query rows(*reader, "SELECT id FROM jobs");
    while (rows.next()) known.insert(rows.text(0));
  }
  files_.clean_leftovers(known, kLeftoverAge);
}

std::string SqliteStore::reserve_id(const std::string& fingerprint) {
  constexpr std::uint32_t kSuffixes = 1U << 24U;
  std::random_device random;
  std::string id = fingerprint;
  while (version_of(id) != 0 || !files_.reserve(id)) id = fmt::format("{}-{:06x}", fingerprint, random() % kSuffixes);
  return id;
}

v1::Job SqliteStore::submit(const NewJob& request, bool& created) {
  return with_store_errors([&] {
    const UploadGuard guard{request};
    created = false;
    {
      ReaderPool::Loan reader(readers_);
      if (auto known = job_of_key(*reader, request)) return *known;
    }
    const std::string id = reserve_id(request.fingerprint);
    try {
      if (!request.weights.empty()) files_.adopt(id, request.weights, file::kWeights);
      files_.adopt(id, request.upload, kUpload);
      if (auto known = insert(request, id)) {
        files_.discard(id);
        return *known;
      }
    } catch (...) {
      files_.discard(id);
      throw;
    }
    created = true;
    spdlog::info("job {} queued: {} bytes, {} faces", id, request.input.bytes(), request.input.faces());
    return find(id).value();
  });
}

std::optional<v1::Job> SqliteStore::insert(const NewJob& request, const std::string& id) {
  v1::Progress progress;
  progress.set_stage("queued");
  progress.set_sweeps(request.parameters.sweeps());
  const std::string input = request.input.SerializeAsString(), parameters = request.parameters.SerializeAsString(),
                    warnings = warnings_bytes({request.warnings.begin(), request.warnings.end()}),
                    progress_bytes = progress.SerializeAsString();
  const auto key = request.idempotency_key.empty() ? std::nullopt : std::optional<std::string>(request.idempotency_key);

  Writer::Transaction transaction(durable_writer_);
  if (auto known = job_of_key(*transaction, request)) return known;
  if (count_queued(*transaction) >= max_queued_) {
    throw crease::Error(code::kQueueFull,
                        fmt::format("{} jobs are queued, the most that this service takes", max_queued_));
  }
  count_change(*transaction);
  Query(*transaction,
        "INSERT INTO jobs (id, state, created, version, input, parameters, warnings, progress, idempotency_key,"
        " request_digest) VALUES (?, 'queued', ?, (SELECT version FROM change_counter), ?, ?, ?, ?, ?, ?)",
        id, now_ms(), Blob{input}, Blob{parameters}, Blob{warnings}, Blob{progress_bytes}, key, request.request_digest)
      .run();
  transaction.commit();
  return std::nullopt;
}

std::optional<v1::Job> SqliteStore::find(std::string_view id) {
  return with_store_errors([&] {
    ReaderPool::Loan reader(readers_);
    return job_of_id(*reader, id);
  });
}

JobPage SqliteStore::list(std::string_view state, std::size_t limit, std::string_view cursor) {
  check_state(state);
  const std::int64_t before = parse_cursor(cursor);
  const auto rows_wanted = static_cast<std::int64_t>(limit) + 1;
  static const std::string any_sql = select_jobs("WHERE (?1 = '') AND seq < ?2 ORDER BY seq DESC LIMIT ?3");
  static const std::string state_sql = select_jobs("WHERE state = ?1 AND seq < ?2 ORDER BY seq DESC LIMIT ?3");
  return with_store_errors([&] {
    ReaderPool::Loan reader(readers_);
    Query rows(*reader, state.empty() ? any_sql : state_sql, state, before, rows_wanted);
    JobPage page;
    std::int64_t last_seq = before;
    while (rows.next()) {
      if (page.jobs.size() == limit) {
        page.next_cursor = cursor_after(last_seq);
        break;
      }
      page.jobs.push_back(read_job(rows));
      last_seq = job_seq(rows);
    }
    return page;
  });
}

std::optional<v1::Job> SqliteStore::cancel(std::string_view id) {
  return with_store_errors([&] {
    Writer::Transaction transaction(durable_writer_);
    count_change(*transaction);
    const std::int64_t now = now_ms();
    const int ended = Query(*transaction,
                            "UPDATE jobs SET state = 'cancelled', finished = ?1, lease_owner = NULL,"
                            " version = (SELECT version FROM change_counter)"
                            " WHERE id = ?2 AND (state = 'queued' OR (state = 'running' AND lease_until <= ?1))",
                            now, id)
                          .run();
    const int asked = Query(*transaction,
                            "UPDATE jobs SET cancel_requested = 1, version = (SELECT version FROM change_counter)"
                            " WHERE id = ? AND state = 'running' AND cancel_requested = 0",
                            id)
                          .run();
    auto job = job_of_id(*transaction, id);
    if (ended + asked > 0) transaction.commit();
    if (ended > 0) spdlog::info("job {} cancelled before it ran to its end, attempt {}", id, job->attempt());
    return job;
  });
}

bool SqliteStore::remove(std::string_view id) {
  const bool removed = with_store_errors([&] {
    Writer::Transaction transaction(durable_writer_);
    count_change(*transaction);
    const int rows = Query(*transaction, "DELETE FROM jobs WHERE id = ?", id).run();
    if (rows > 0) transaction.commit();
    return rows > 0;
  });
  if (removed) {
    files_.discard(id);
    spdlog::info("job {} removed", id);
  }
  return removed;
}

std::uint64_t SqliteStore::last_version() {
  return with_store_errors([&] {
    ReaderPool::Loan reader(readers_);
    Query row(*reader, "SELECT version FROM change_counter");
    row.next();
    return static_cast<std::uint64_t>(row.integer(0));
  });
}

std::vector<JobChange> SqliteStore::changes_since(std::uint64_t since) {
  return with_store_errors([&] {
    ReaderPool::Loan reader(readers_);
    Query rows(*reader, "SELECT id, version FROM jobs WHERE version > ? ORDER BY version",
               static_cast<std::int64_t>(since));
    std::vector<JobChange> changes;
    while (rows.next()) changes.push_back({rows.text(0), static_cast<std::uint64_t>(rows.integer(1))});
    return changes;
  });
}

std::uint64_t SqliteStore::version_of(std::string_view id) {
  return with_store_errors([&] {
    ReaderPool::Loan reader(readers_);
    Query row(*reader, "SELECT version FROM jobs WHERE id = ?", id);
    return row.next() ? static_cast<std::uint64_t>(row.integer(0)) : 0;
  });
}

std::string SqliteStore::not_ready_reason() {
  try {
    files_.probe();
    with_store_errors([&] {
      Writer::Transaction transaction(durable_writer_);
      Query(*transaction, "UPDATE change_counter SET version = version").run();
      transaction.commit();
    });
    return {};
  } catch (const crease::Error& error) {
    return error.detail();
  }
}

std::size_t SqliteStore::queued() {
  return with_store_errors([&] {
    ReaderPool::Loan reader(readers_);
    return count_queued(*reader);
  });
}

std::filesystem::path SqliteStore::upload_path(std::string_view id) const { return files_.path(id, kUpload); }

std::filesystem::path SqliteStore::file_path(std::string_view id, std::string_view name) const {
  return files_.path(id, name);
}

std::filesystem::path SqliteStore::temporary_path() { return files_.temporary_path(); }

std::unique_ptr<Store> open_store(const StoreOptions& options) {
  constexpr std::string_view kPostgres = "postgresql://";
  if (options.url.starts_with(kPostgres)) {
    throw crease::Error(code::kStoreUnavailable, "this build of creased has no PostgreSQL store; use 'sqlite'");
  }
  if (options.url != "sqlite") {
    throw crease::Error(code::kStoreUnavailable, fmt::format("there is no store '{}'; use 'sqlite'", options.url));
  }
  return with_store_errors([&]() -> std::unique_ptr<Store> { return std::make_unique<SqliteStore>(options); });
}

}  // namespace creased
