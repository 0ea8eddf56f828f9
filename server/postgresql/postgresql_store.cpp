#include "server/postgresql/postgresql_store.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <limits>
#include <random>

#include "server/base/failure.h"
#include "server/jobs/needs.h"
#include "server/postgresql/await_tables.h"
#include "server/postgresql/job_rows.h"
#include "server/store/job_facts.h"

namespace creased {
namespace code = crease::code;
namespace v1 = crease::v1;
namespace {

constexpr std::uint64_t kCacheBytes = 256U << 20U;

/// A new file of this machine without a name, to write and to read.
Descriptor nameless_file(const std::filesystem::path& path) {
  Descriptor file(::open(path.c_str(), O_CREAT | O_EXCL | O_RDWR | O_CLOEXEC, 0600));
  if (!file.open()) throw file_failure("create", path);
  ::unlink(path.c_str());
  return file;
}

/// The same file, for those who may only read it.
std::shared_ptr<const OpenFile> only_to_read(const Descriptor& file) {
  auto opened = open_file(fmt::format("/proc/self/fd/{}", file.get()));
  if (opened == nullptr) throw crease::Error(code::kStoreUnavailable, "cannot open a file anew: /proc is missing");
  return opened;
}

/// A page, the newest job first. The rows are compared and ordered by all columns of an index, because PostgreSQL may
/// take the order of another one for cheaper and pass over all that it has not asked for.
std::string select_page(bool of_owner, bool of_state) {
  const std::string owner = of_owner ? "owner, " : "", state = of_state ? "state, " : "",
                    columns = owner + state + "seq",
                    values = std::string(of_owner ? "$2, " : "") + (of_state ? "$3, " : "");
  return select_jobs_with(
      fmt::format("WHERE ({0}) < ({1}$1) AND ({0}) >= ({1}0) AND ($2::text IS NULL) = {2} AND ($3 = '') = {3}"
                  " ORDER BY {4} seq DESC LIMIT $4",
                  columns, values, !of_owner, !of_state,
                  std::string(of_owner ? "owner DESC, " : "") + (of_state ? "state DESC," : "")));
}

std::string url_of(const StoreOptions& options) { return with_timeouts(options.url); }

}  // namespace

PostgresqlStore::PostgresqlStore(const StoreOptions& options)
    : DatabaseStore(options), url_(url_of(options)), sessions_(url_), listener_(url_), blobs_(kCacheBytes) {
  discard_removed();
  clean_leftovers();
}

std::int64_t PostgresqlStore::count_change(Transaction& transaction) {
  return transaction.run("SELECT count_change()")[0][0].as<std::int64_t>();
}

void PostgresqlStore::tell(Transaction& transaction, Channel channel) {
  transaction.run("SELECT pg_notify($1, '')", std::string(name_of(channel)));
}

void PostgresqlStore::commit(Transaction& transaction, std::int64_t version) {
  transaction.commit();
  listener_.note_version(static_cast<std::uint64_t>(version));
}

std::optional<v1::Job> PostgresqlStore::job_of_key(Transaction& transaction, const NewJob& request) {
  if (request.idempotency_key.empty()) return std::nullopt;
  static const std::string sql = select_jobs_with("WHERE owner = $1 AND idempotency_key = $2");
  const auto rows = transaction.run(sql, request.owner, request.idempotency_key);
  if (rows.empty()) return std::nullopt;
  v1::Job job = job_in(rows[0]);
  const auto same =
      transaction.run("SELECT 1 FROM jobs WHERE id = $1 AND request_digest = $2", job.id(), request.request_digest);
  if (same.empty()) throw_conflict(job.id());
  return job;
}

v1::Job PostgresqlStore::submit(const NewJob& request, bool& created) {
  return guarded([&] {
    const UploadGuard guard{request};
    created = false;
    Transaction transaction(sessions_);
    if (auto known = job_of_key(transaction, request)) return *known;
    std::vector<std::pair<FileRecord, BlobRef>> files;
    const auto add = [&](std::string_view name, const std::filesystem::path& path, const std::string& sha256) {
      const BlobRef blob = write_blob(transaction, open_to_read(path).get(), path);
      files.push_back({{std::string(name), blob.bytes, sha256}, blob});
    };
    add(file::kUpload, request.upload, request.input.sha256());
    if (!request.weights.empty()) add(file::kWeights, request.weights, request.input.weights_sha256());
    std::uint64_t bytes = needs_of(request.input, request.parameters).disk_bytes;
    for (const auto& [record, blob] : files) bytes += blob.bytes;

    const std::int64_t version = count_change(transaction);  // from here on, one submission at a time
    if (auto known = job_of_key(transaction, request)) return *known;
    check_limits(usage_in(transaction, std::nullopt), usage_in(transaction, request.owner), options_,
                 request.owner_limits, bytes);
    const std::string id = insert(transaction, request, bytes, version);
    for (const auto& [record, blob] : files) put_file(transaction, id, record, blob);
    v1::Job job = job_with_id(transaction, id).value();
    tell(transaction, Channel::kQueue);
    commit(transaction, version);
    created = true;
    const std::lock_guard lock(mutex_);
    look_for_work_at_ = {};
    spdlog::info("job {} queued: {} bytes, {} faces", id, request.input.bytes(), request.input.faces());
    return job;
  });
}

/// Returns the id of the new job: its fingerprint, or with a suffix when another job has that.
std::string PostgresqlStore::insert(Transaction& transaction, const NewJob& request, std::uint64_t bytes,
                                    std::int64_t version) {
  constexpr std::uint32_t kSuffixes = 1U << 24U;
  std::random_device random;
  const std::string input = request.input.SerializeAsString(), parameters = request.parameters.SerializeAsString(),
                    warnings = warnings_bytes({request.warnings.begin(), request.warnings.end()}),
                    progress = first_progress(request.parameters).SerializeAsString();
  const auto key = request.idempotency_key.empty() ? std::nullopt : std::optional<std::string>(request.idempotency_key);
  const std::int64_t work = needs_of(request.input, request.parameters).work.count();
  std::string id = request.fingerprint;
  for (;;) {
    const auto rows = transaction.run(
        "INSERT INTO jobs (id, owner, state, created, retention, bytes, version, input, parameters, warnings, progress,"
        " idempotency_key, request_digest, rank)"
        " SELECT $1, $2, 'queued', now, $3, $4, $5, $6, $7, $8, $9, $10, $11, now + $12 FROM now_ms() AS now"
        " ON CONFLICT (id) DO NOTHING RETURNING id",
        id, request.owner, retention_ms(request.parameters), static_cast<std::int64_t>(bytes), version, Bytes{input},
        Bytes{parameters}, Bytes{warnings}, Bytes{progress}, key, request.request_digest, work);
    if (!rows.empty()) return id;
    id = fmt::format("{}-{:06x}", request.fingerprint, random() % kSuffixes);
  }
}

std::optional<v1::Job> PostgresqlStore::find(std::string_view id, const Owner& owner) {
  return guarded([&] {
    Transaction transaction(sessions_);
    return job_with_id(transaction, id, owner);
  });
}

JobPage PostgresqlStore::list(std::string_view state, std::size_t limit, std::string_view cursor, const Owner& owner) {
  check_state(state);
  const std::int64_t before = parse_cursor(cursor);
  const std::string sql = select_page(owner.has_value(), !state.empty());
  return guarded([&] {
    Transaction transaction(sessions_);
    const auto rows = transaction.run(sql, before, owner, state, static_cast<std::int64_t>(limit) + 1);
    std::vector<ListedJob> found;
    for (const auto& row : rows) found.push_back({seq_in(row), job_in(row)});
    return page_of(std::move(found), limit);
  });
}

std::optional<v1::Job> PostgresqlStore::cancel(std::string_view id, const Owner& owner) {
  return guarded([&]() -> std::optional<v1::Job> {
    Transaction transaction(sessions_);
    static const std::string sql = fmt::format(
        "SELECT {}, id, progress, lease_until <= now_ms() FROM jobs WHERE id = $1 AND ($2::text IS NULL OR owner = $2)"
        " FOR UPDATE",
        columns_of_life());
    const auto rows = transaction.run(sql, id, owner);
    if (rows.empty()) return std::nullopt;
    const pqxx::row row = rows[0];
    Life life = life_in(row);
    const bool runs = life.state == JobState::kRunning;
    if (runs && row[kColumnsOfLife + 2].as<bool>()) life.state = JobState::kQueued;
    const Life after = cancelled(life);
    if (after == life) return job_with_id(transaction, id);
    const std::string job_id = row[kColumnsOfLife].as<std::string>();
    const std::int64_t version = take(transaction, {job_id, life, bytes_of(row[kColumnsOfLife + 1])}, {after});
    auto job = job_with_id(transaction, id);
    if (runs) tell(transaction, Channel::kHolds);
    commit(transaction, version);
    if (is_terminal(after.state)) spdlog::info("job {} cancelled before its end, in attempt {}", id, job->attempt());
    return job;
  });
}

void PostgresqlStore::cancel_all(const std::string& owner) {
  std::vector<std::string> ids;
  guarded([&] {
    Transaction transaction(sessions_);
    const auto rows = transaction.run("SELECT id FROM jobs WHERE owner = $1 AND state IN ('queued', 'running')", owner);
    for (const auto& row : rows) ids.push_back(row[0].as<std::string>());
  });
  for (const std::string& id : ids) cancel(id, owner);
}

std::vector<std::string> PostgresqlStore::busy_owners() {
  return guarded([&] {
    Transaction transaction(sessions_);
    std::vector<std::string> owners;
    for (const auto& row : transaction.run("SELECT DISTINCT owner FROM jobs WHERE state IN ('queued', 'running')")) {
      owners.push_back(row[0].as<std::string>());
    }
    return owners;
  });
}

std::size_t PostgresqlStore::queued() {
  return guarded([&] {
    Transaction transaction(sessions_);
    return usage_in(transaction, std::nullopt).queued;
  });
}

std::chrono::milliseconds PostgresqlStore::longest_wait() {
  return guarded([&] {
    Transaction transaction(sessions_);
    const auto rows = transaction.run(
        "SELECT greatest(now_ms() - created, 0) FROM jobs WHERE (state, seq) >= ('queued', 0)"
        " AND (state, seq) <= ('queued', $1) ORDER BY state, seq LIMIT 1",
        std::numeric_limits<std::int64_t>::max());
    return std::chrono::milliseconds(rows.empty() ? 0 : rows[0][0].as<std::int64_t>());
  });
}

std::uint64_t PostgresqlStore::last_version() {
  if (const auto told = listener_.last_version(); told > 0) return told;
  return guarded([&] {
    Transaction transaction(sessions_);
    return transaction.run("SELECT version FROM change_counter")[0][0].as<std::uint64_t>();
  });
}

std::vector<JobChange> PostgresqlStore::changes_since(std::uint64_t since) {
  return guarded([&] {
    Transaction transaction(sessions_);
    std::vector<JobChange> changes;
    for (const auto& row : transaction.run("SELECT id, version, state FROM jobs WHERE version > $1 ORDER BY version",
                                           static_cast<std::int64_t>(since))) {
      changes.push_back({row[0].as<std::string>(), row[1].as<std::uint64_t>(), row[2].as<std::string>()});
    }
    return changes;
  });
}

std::uint64_t PostgresqlStore::version_of(std::string_view id) {
  return guarded([&] {
    Transaction transaction(sessions_);
    const auto rows = transaction.run("SELECT version FROM jobs WHERE id = $1", id);
    return rows.empty() ? 0 : rows[0][0].as<std::uint64_t>();
  });
}

std::vector<std::string> PostgresqlStore::missing(const std::vector<std::string>& ids) {
  return guarded([&] {
    Transaction transaction(sessions_);
    std::vector<std::string> gone;
    for (const auto& row : transaction.run("SELECT asked FROM unnest($1::text[]) AS asked"
                                           " WHERE NOT EXISTS (SELECT 1 FROM jobs WHERE id = asked)",
                                           fmt::format("{{{}}}", fmt::join(ids, ",")))) {
      gone.push_back(row[0].as<std::string>());
    }
    return gone;
  });
}

std::shared_ptr<const OpenFile> PostgresqlStore::open(std::string_view id, std::string_view name) {
  files_.path(id, name);  // refuses what is no id or no name
  return guarded([&]() -> std::shared_ptr<const OpenFile> {
    Transaction transaction(sessions_, Transaction::View::kFrozen);
    const auto rows = transaction.run("SELECT blob, bytes FROM files WHERE job = $1 AND name = $2", id, name);
    if (rows.empty()) return nullptr;
    const BlobRef blob{rows[0][0].as<std::int64_t>(), rows[0][1].as<std::uint64_t>()};
    if (auto known = blobs_.find(blob.id)) return known;
    const auto path = files_.temporary_path();
    const Descriptor file = nameless_file(path);
    read_blob(transaction, blob, file.get(), path);
    auto opened = only_to_read(file);
    blobs_.add(blob.id, opened);
    return opened;
  });
}

std::optional<FileRecord> PostgresqlStore::file_record(std::string_view id, std::string_view name) {
  return guarded([&]() -> std::optional<FileRecord> {
    Transaction transaction(sessions_);
    const auto rows = transaction.run("SELECT bytes, sha256 FROM files WHERE job = $1 AND name = $2", id, name);
    if (rows.empty()) return std::nullopt;
    return FileRecord{std::string(name), rows[0][0].as<std::uint64_t>(), rows[0][1].as<std::string>()};
  });
}

bool PostgresqlStore::keep_file(std::string_view id, const FileRecord& file, const std::filesystem::path& made) {
  return guarded([&] {
    Transaction transaction(sessions_);
    transaction.relax();
    const BlobRef blob = write_blob(transaction, open_to_read(made).get(), made);
    if (transaction.run("SELECT 1 FROM jobs WHERE id = $1 FOR UPDATE", id).empty()) return false;
    const bool bounded = options_.quota_bytes > 0;
    if (bounded && usage_in(transaction, std::nullopt).bytes + file.bytes > options_.quota_bytes) return false;
    transaction.run(
        "UPDATE jobs SET bytes = bytes + $3 - coalesce((SELECT bytes FROM files WHERE job = $1 AND name = $2), 0)"
        " WHERE id = $1",
        id, file.name, static_cast<std::int64_t>(file.bytes));
    put_file(transaction, id, file, blob);
    transaction.commit();
    std::error_code ignored;
    std::filesystem::remove(made, ignored);
    return true;
  });
}

void PostgresqlStore::put_file(Transaction& transaction, std::string_view id, const FileRecord& file,
                               const BlobRef& blob) {
  transaction.run(
      "INSERT INTO files VALUES ($1, $2, $3, $4, $5) ON CONFLICT (job, name)"
      " DO UPDATE SET bytes = excluded.bytes, sha256 = excluded.sha256, blob = excluded.blob",
      id, file.name, static_cast<std::int64_t>(file.bytes), file.sha256, blob.id);
}

std::unique_ptr<Store> open_postgresql_store(const StoreOptions& options) {
  await_tables(url_of(options));
  return std::make_unique<PostgresqlStore>(options);
}

}  // namespace creased
