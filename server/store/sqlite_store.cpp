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

/// Removes the files of a submission, unless they were moved.
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
  static const std::string sql = select_jobs("WHERE owner = ? AND idempotency_key = ?");
  Query known(connection, sql, request.owner, request.idempotency_key);
  if (!known.next()) return std::nullopt;
  v1::Job job = read_job(known);
  Query same(connection, "SELECT 1 FROM jobs WHERE id = ? AND request_digest = ?", job.id(), request.request_digest);
  if (!same.next()) {
    throw crease::Error(
        code::kIdempotencyConflict,
        fmt::format("the key was already used for a different request, which created job {}", job.id()));
  }
  return job;
}

// Condition on the owner; ?2 is bound to an Owner.
constexpr std::string_view kOfOwner = "(?2 IS NULL OR owner = ?2)";

std::optional<v1::Job> job_of_id(Connection& connection, std::string_view id, const Owner& owner = std::nullopt) {
  static const std::string sql = select_jobs(fmt::format("WHERE id = ?1 AND {}", kOfOwner));
  Query row(connection, sql, id, owner);
  if (!row.next()) return std::nullopt;
  return read_job(row);
}

struct Usage {
  std::size_t queued = 0;
  std::uint64_t bytes = 0;
};

Usage usage_of(Connection& connection, const Owner& owner) {
  Query row(connection,
            "SELECT coalesce(sum(queued), 0), coalesce(sum(bytes), 0) FROM usage WHERE ?1 IS NULL OR owner = ?1",
            owner);
  row.next();
  return {static_cast<std::size_t>(row.integer(0)), static_cast<std::uint64_t>(row.integer(1))};
}

std::size_t count_queued(Connection& connection) { return usage_of(connection, std::nullopt).queued; }

std::uint64_t size_of(const std::filesystem::path& path) {
  std::error_code failed;
  const auto bytes = std::filesystem::file_size(path, failed);
  return failed ? 0 : bytes;
}

/// An estimate of the disk space that a job needs: its upload, and per face its checkpoint, snapshot and result, each
/// twice while a new file replaces an old one.
std::uint64_t bytes_needed(const NewJob& job) {
  constexpr std::uint64_t kPerFace = 400, kPerSweep = 200, kForm = 64 * 1024;
  return size_of(job.upload) + size_of(job.weights) + job.input.faces() * kPerFace +
         job.parameters.sweeps() * kPerSweep + kForm;
}

/// Space to leave free for the database and for other programs.
std::uint64_t reserve_of(const JobFiles::Room& room) {
  constexpr std::uint64_t kMost = 64U << 20U, kPart = 20;
  return std::min(kMost, room.total / kPart);
}

std::string megabytes(std::uint64_t bytes) {
  constexpr double kMegabyte = 1U << 20U;
  return fmt::format("{:.1f} MiB", static_cast<double>(bytes) / kMegabyte);
}

std::int64_t retention_ms(const v1::Parameters& parameters) {
  constexpr double kMsPerHour = 3'600'000;
  return static_cast<std::int64_t>(parameters.retention_hours() * kMsPerHour);
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
      quota_bytes_(options.quota_bytes),
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
  discard_removed();
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
    return find(id, std::nullopt).value();
  });
}

std::optional<v1::Job> SqliteStore::insert(const NewJob& request, const std::string& id) {
  v1::Progress progress;
  progress.set_stage("queued");
  progress.set_sweeps(request.parameters.sweeps());
  const std::string input = request.input.SerializeAsString(), parameters = request.parameters.SerializeAsString(),
                    warnings = warnings_bytes({request.warnings.begin(), request.warnings.end()}),
                    progress_bytes = progress.SerializeAsString();
  const std::uint64_t bytes = bytes_needed(request);
  const auto key = request.idempotency_key.empty() ? std::nullopt : std::optional<std::string>(request.idempotency_key);

  Writer::Transaction transaction(durable_writer_);
  if (auto known = job_of_key(*transaction, request)) return known;
  check_room(*transaction, request, bytes);
  count_change(*transaction);
  Query(*transaction,
        "INSERT INTO jobs (id, owner, state, created, retention, bytes, version, input, parameters, warnings, progress,"
        " idempotency_key, request_digest)"
        " VALUES (?, ?, 'queued', ?, ?, ?, (SELECT version FROM change_counter), ?, ?, ?, ?, ?, ?)",
        id, request.owner, now_ms(), retention_ms(request.parameters), static_cast<std::int64_t>(bytes), Blob{input},
        Blob{parameters}, Blob{warnings}, Blob{progress_bytes}, key, request.request_digest)
      .run();
  transaction.commit();
  return std::nullopt;
}

void SqliteStore::check_room(Connection& connection, const NewJob& request, std::uint64_t bytes) const {
  const Usage all = usage_of(connection, std::nullopt), own = usage_of(connection, request.owner);
  const OwnerLimits& limits = request.owner_limits;
  if (all.queued >= max_queued_) {
    throw crease::Error(code::kQueueFull,
                        fmt::format("{} jobs are queued, the most that this service allows", max_queued_));
  }
  if (limits.max_queued > 0 && own.queued >= limits.max_queued) {
    throw crease::Error(code::kKeyQueueFull,
                        fmt::format("{} jobs are queued, the most that this key may have", limits.max_queued));
  }
  const auto check_quota = [&](std::uint64_t used, std::uint64_t quota, std::string_view whose) {
    if (quota == 0 || used + bytes <= quota) return;
    throw crease::Error(code::kQuotaExceeded,
                        fmt::format("the job may need {}, but {} of the {} that {} may use are taken; delete jobs or "
                                    "wait until results expire",
                                    megabytes(bytes), megabytes(used), megabytes(quota), whose));
  };
  check_quota(own.bytes, limits.max_bytes, "this key");
  check_quota(all.bytes, quota_bytes_, "this service");
  const auto room = files_.room();
  if (room.free < bytes + reserve_of(room)) {
    throw crease::Error(code::kStorageFull, fmt::format("the job may need {}, but the disk has only {} left",
                                                        megabytes(bytes), megabytes(room.free)));
  }
}

std::optional<v1::Job> SqliteStore::find(std::string_view id, const Owner& owner) {
  return with_store_errors([&] {
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
  return with_store_errors([&] {
    ReaderPool::Loan reader(readers_);
    Query rows(*reader, sql, before, owner, state, rows_wanted);
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

std::optional<v1::Job> SqliteStore::cancel(std::string_view id, const Owner& owner) {
  return with_store_errors([&] {
    Writer::Transaction transaction(durable_writer_);
    if (!job_of_id(*transaction, id, owner)) return std::optional<v1::Job>();
    count_change(*transaction);
    const std::int64_t now = now_ms();
    const int ended =
        Query(*transaction,
              "UPDATE jobs SET state = 'cancelled', finished = ?1, expires = ?1 + retention, lease_owner = NULL,"
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
    if (ended > 0) {
      files_.remove_working_files(id);
      Query(*transaction, "UPDATE jobs SET bytes = ? WHERE id = ?", files_.bytes(id), id).run();
    }
    if (ended + asked > 0) transaction.commit();
    if (ended > 0) spdlog::info("job {} cancelled before its end, in attempt {}", id, job->attempt());
    return job;
  });
}

bool SqliteStore::remove(std::string_view id, const Owner& owner) {
  const bool removed = with_store_errors([&] {
    Writer::Transaction transaction(durable_writer_);
    count_change(*transaction);
    const int rows =
        Query(*transaction, fmt::format("DELETE FROM jobs WHERE id = ?1 AND {}", kOfOwner), id, owner).run();
    if (rows > 0) transaction.commit();
    return rows > 0;
  });
  if (removed) {
    discard_removed();
    spdlog::info("job {} removed", id);
  }
  return removed;
}

std::vector<std::string> SqliteStore::remove_expired() {
  std::vector<std::string> ids = with_store_errors([&] {
    Writer::Transaction transaction(durable_writer_);
    std::vector<std::string> expired;
    {
      Query rows(*transaction, "DELETE FROM jobs WHERE expires <= ? RETURNING id", now_ms());
      while (rows.next()) expired.push_back(rows.text(0));
    }
    if (expired.empty()) return expired;
    count_change(*transaction);
    transaction.commit();
    return expired;
  });
  for (const std::string& id : ids) spdlog::info("job {} removed: its retention time was over", id);
  discard_removed();
  return ids;
}

/// Deletes each row after its files, so that another process can finish what a killed one has left.
void SqliteStore::discard_removed() {
  with_store_errors([&] {
    std::vector<std::string> ids;
    {
      ReaderPool::Loan reader(readers_);
      Query rows(*reader, "SELECT id FROM removed");
      while (rows.next()) ids.push_back(rows.text(0));
    }
    for (const std::string& id : ids) {
      files_.discard(id);
      Writer::Transaction transaction(durable_writer_);
      Query(*transaction, "DELETE FROM removed WHERE id = ?", id).run();
      transaction.commit();
    }
  });
}

bool SqliteStore::charge(std::string_view id, std::uint64_t bytes) {
  const auto room = files_.room();
  if (room.free < bytes + reserve_of(room)) return false;
  return with_store_errors([&] {
    Writer::Transaction transaction(writer_);
    if (quota_bytes_ > 0 && usage_of(*transaction, std::nullopt).bytes + bytes > quota_bytes_) return false;
    const int rows =
        Query(*transaction, "UPDATE jobs SET bytes = bytes + ? WHERE id = ?", static_cast<std::int64_t>(bytes), id)
            .run();
    transaction.commit();
    return rows > 0;
  });
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
    const auto room = files_.room();
    if (room.free < reserve_of(room)) return fmt::format("only {} of disk space are left", megabytes(room.free));
    return with_store_errors([&] {
      Writer::Transaction transaction(durable_writer_);
      Query(*transaction, "UPDATE change_counter SET version = version").run();
      const std::uint64_t bytes = usage_of(*transaction, std::nullopt).bytes;
      transaction.commit();
      return quota_bytes_ > 0 && bytes >= quota_bytes_
                 ? fmt::format("the quota of {} is used up", megabytes(quota_bytes_))
                 : std::string();
    });
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
    throw crease::Error(code::kStoreUnavailable, "this build does not support PostgreSQL; use 'sqlite'");
  }
  if (options.url != "sqlite") {
    throw crease::Error(code::kStoreUnavailable, fmt::format("unknown store '{}'; use 'sqlite'", options.url));
  }
  return with_store_errors([&]() -> std::unique_ptr<Store> { return std::make_unique<SqliteStore>(options); });
}

}  // namespace creased
