#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "crease/v1/job.pb.h"
#include "server/base/durable_file.h"
#include "server/base/failure.h"
#include "server/jobs/life.h"

namespace creased {

/// What one owner may have in the store; 0 for no limit per owner.
struct OwnerLimits {
  std::size_t max_queued = 0;
  std::uint64_t max_bytes = 0;
};

/// A job as submitted. The store takes over the files of the upload and the weights.
struct NewJob {
  std::string owner;  ///< id of the caller's key; empty on a service without keys
  OwnerLimits owner_limits;
  std::string fingerprint;        ///< becomes the id; a suffix is added when another job has that id
  std::filesystem::path upload;   ///< at a temporary_path(); submit() moves or removes it
  std::filesystem::path weights;  ///< likewise; empty for none
  crease::v1::InputFacts input;
  crease::v1::Parameters parameters;  ///< resolved; they include the retention time
  std::vector<crease::v1::Warning> warnings;
  std::string idempotency_key;  ///< empty for none
  std::string request_digest;   ///< must be the same for a retry with the same idempotency key
};

/// A worker's right to a job, until its lease expires.
struct Claim {
  std::string job_id;
  std::string owner;
  std::uint32_t attempt = 0;
};

/// The owner whose jobs a call may see; nullopt for all jobs.
using Owner = std::optional<std::string>;

struct JobPage {
  std::vector<crease::v1::Job> jobs;  ///< newest first
  std::string next_cursor;            ///< empty on the last page
};

struct JobChange {
  std::string job_id;
  std::uint64_t version = 0;
  std::string state;
};

/// A complete file of a job, as it was when it was written.
struct FileRecord {
  std::string name;
  std::uint64_t bytes = 0;
  std::string sha256;  ///< 64 hexadecimal digits
};

/// What a worker process says of itself.
struct WorkerHealth {
  std::string name;
  std::chrono::milliseconds age{0};  ///< since it said so
  std::string problem;               ///< why it cannot run jobs; empty when it can
};

/// What callers ask and order. Calls with an `owner` treat the jobs of others as if they did not exist.
class JobDesk {
 public:
  virtual ~JobDesk() = default;

  /// Stores a job; it is on the disk when the call returns. If the owner has used the idempotency key before, returns
  /// the job of that key and sets `created` to false.
  /// \throw Error idempotency_conflict when the key was used for a different request, queue_full and key_queue_full
  /// over the limits of queued jobs, quota_exceeded over those of space, storage_full when the disk has no room for the
  /// job
  virtual crease::v1::Job submit(const NewJob& job, bool& created) = 0;
  virtual std::optional<crease::v1::Job> find(std::string_view id, const Owner& owner = std::nullopt) = 0;
  /// \throw Error parameter_invalid for a cursor that did not come from this store
  virtual JobPage list(std::string_view state, std::size_t limit, std::string_view cursor,
                       const Owner& owner = std::nullopt) = 0;
  /// Cancels a queued job at once and a running one within a sweep. Leaves an ended job as it is. Returns nullopt when
  /// there is no such job.
  virtual std::optional<crease::v1::Job> cancel(std::string_view id, const Owner& owner = std::nullopt) = 0;
  /// Cancels all jobs of an owner that have not ended.
  virtual void cancel_all(const std::string& owner) = 0;
  /// The owners of jobs that have not ended.
  virtual std::vector<std::string> busy_owners() = 0;
  /// Removes a job and all its data, durably. Its worker, if any, abandons it. Returns false when there is no such job.
  virtual bool remove(std::string_view id, const Owner& owner = std::nullopt) = 0;
  virtual std::size_t queued() = 0;
  /// How long the job that was submitted first of the queued ones has waited; 0 when none is queued.
  virtual std::chrono::milliseconds longest_wait() = 0;
};

/// What changed since when. Callers ask for the last version as often as they like: it costs a store on another machine
/// nothing while nothing changes.
class ChangeFeed {
 public:
  virtual ~ChangeFeed() = default;

  /// The version grows with every change of any job. changes_since() lists the jobs changed after `since`, the oldest
  /// change first, without removed jobs.
  virtual std::uint64_t last_version() = 0;
  virtual std::vector<JobChange> changes_since(std::uint64_t since) = 0;
  /// The version at which a job last changed; 0 when there is no such job.
  virtual std::uint64_t version_of(std::string_view id) = 0;
  /// Those of the ids that no job has.
  virtual std::vector<std::string> missing(const std::vector<std::string>& ids) = 0;
};

/// What workers do. See jobs/life.h for what becomes of a job.
class JobQueue {
 public:
  virtual ~JobQueue() = default;

  /// Claims a job that is queued and need not wait. Each owner gets its share: next is the owner with the fewest
  /// running jobs, among these the one that was served longest ago. Of its jobs, the one that was submitted first is
  /// next, where a job counts as submitted later by the time that it will take, so that small jobs pass large ones and
  /// none waits for ever. Jobs whose lease has expired lose their attempt first. Nothing is claimed while the store
  /// cannot write. Idle workers call this many times a second. \throw Error store_unavailable, storage_full
  virtual std::optional<Claim> claim(std::string_view worker, std::chrono::milliseconds lease) = 0;
  enum class Hold { kHeld, kCancelRequested, kLost };
  /// Whether the job still belongs to this worker, and whether it should stop. Cheap.
  virtual Hold check(const Claim& claim) = 0;
  virtual Hold renew(const Claim& claim, std::chrono::milliseconds lease) = 0;
  virtual void publish_progress(const Claim& claim, const crease::v1::Progress& progress) = 0;
  /// The checkpoint at its working_path() is complete.
  virtual void note_checkpoint(const Claim& claim) = 0;
  /// Likewise the snapshot.
  virtual void note_snapshot(const Claim& claim) = 0;
  // Calls that end a claim. They return false and change nothing when the job no longer belongs to this worker.
  /// A complete job succeeds even if it should have been cancelled. `warnings` are added to those of the submission,
  /// `files` are what the job leaves, each complete at its working_path().
  virtual bool succeed(const Claim& claim, const crease::v1::ResultFacts& result,
                       const std::vector<crease::v1::Warning>& warnings, const std::vector<FileRecord>& files = {}) = 0;
  virtual bool fail(const Claim& claim, const crease::v1::Problem& problem) = 0;
  virtual bool finish_cancelled(const Claim& claim) = 0;
  virtual bool put_back(const Claim& claim) = 0;
  virtual bool defer(const Claim& claim, const crease::Error& reason) = 0;
  virtual bool lose(const Claim& claim, const Loss& loss) = 0;
  /// The names of the workers that hold claims.
  virtual std::vector<std::string> busy_workers() = 0;
  /// Records that a worker has ended: the attempts that it had claimed are lost.
  virtual void lose_all(std::string_view worker, const Loss& loss) = 0;
  /// Records that a worker lives and why it cannot run jobs, if it cannot.
  virtual void note_worker(std::string_view name, std::string_view problem) = 0;
  virtual std::vector<WorkerHealth> workers() = 0;
};

/// The files of jobs. Whoever has opened one keeps what he has, even when it is replaced or removed.
class FileStore {
 public:
  virtual ~FileStore() = default;

  /// Opens a file of a job; null when there is none. \throw Error job_not_found for text that cannot be a job id or the
  /// name of a file, store_unavailable, storage_full
  virtual std::shared_ptr<const OpenFile> open(std::string_view id, std::string_view name) = 0;
  /// Where the worker that holds a claim writes a file of the job, which becomes the job's by one of the calls of
  /// JobQueue. The file system is this machine's.
  virtual std::filesystem::path working_path(const Claim& claim, std::string_view name) const = 0;
  /// A new path on the same file system, for uploads that are being received and files that are being made.
  virtual std::filesystem::path temporary_path() = 0;
  /// What the store knows of a complete file of a job.
  virtual std::optional<FileRecord> file_record(std::string_view id, std::string_view name) = 0;
  /// Takes over the file at the temporary_path() `made`, which was made from a job's result, in place of an earlier
  /// one, and counts its bytes. Returns false, and leaves it, when there is no room or no such job.
  virtual bool keep_file(std::string_view id, const FileRecord& record, const std::filesystem::path& made) = 0;
};

/// What has to be done now and then.
class Upkeep {
 public:
  virtual ~Upkeep() = default;

  /// Removes jobs whose retention time is over, and what interrupted removals have left. Returns the ids of the jobs.
  /// When the clock was set since the last call, the times of expiry move with it.
  virtual std::vector<std::string> remove_expired() = 0;
  /// Removes what killed processes have left behind for an hour.
  virtual void clean_leftovers() = 0;
  /// Writes and syncs. Returns why the store cannot take jobs, for example a full disk; empty when it can.
  virtual std::string not_ready_reason() = 0;
  /// Whether servers and workers on other machines may use the store, too.
  virtual bool is_shared() const = 0;
  /// The secret that signs links, the same for all who share the store: `fresh` when there was none. A store that is
  /// not shared has none.
  virtual std::string link_secret(const std::string& fresh) = 0;
};

/// Jobs and their files: the only channel between the HTTP side and the workers. Many threads and processes may use it
/// at once. The links of a Job are added by the HTTP side.
class Store : public JobDesk, public ChangeFeed, public JobQueue, public FileStore, public Upkeep {};

/// The files of a job.
namespace file {
inline constexpr std::string_view kUpload = "upload";
inline constexpr std::string_view kWeights = "weights.json";   ///< as sent; only when weights were sent
inline constexpr std::string_view kResult = "result.pb";       ///< crease.v1.LabelledMesh
inline constexpr std::string_view kReport = "report.pb";       ///< crease.v1.Report
inline constexpr std::string_view kCheckpoint = "checkpoint";  ///< state from which an interrupted run continues
inline constexpr std::string_view kAccepted = "job.pb";        ///< crease.v1.StoredJob
inline constexpr std::string_view kEnd = "end.pb";             ///< crease.v1.StoredEnd of a job that succeeded
inline constexpr std::string_view kSnapshot = "snapshot.pb";   ///< crease.v1.LabelledMesh of a running job
}  // namespace file

/// What to do with the files of jobs that the database does not know, when the database is new.
enum class Orphans { kRefuse, kAdopt, kDiscard };

struct StoreOptions {
  std::string url = "sqlite";
  std::filesystem::path data_dir;
  std::size_t max_queued = 10'000;
  std::uint32_t max_attempts = 3;
  std::uint64_t quota_bytes = 0;  ///< for all jobs together; 0 for no limit but the disk
  /// Checks the database, and makes lost rows again from the files. For the first server on a data folder, not for its
  /// workers.
  bool recover = false;
  Orphans orphans = Orphans::kRefuse;
};

/// Whether a URL is one of PostgreSQL's: postgresql:// or postgres://.
bool is_postgresql(std::string_view url);

using StoreOpener = std::unique_ptr<Store> (*)(const StoreOptions&);
/// Lets open_store() open stores in PostgreSQL. Only a program that links its client calls this, before anything else.
void enable_postgresql(StoreOpener opener);

/// Opens or creates a store. \throw Error store_unavailable
std::unique_ptr<Store> open_store(const StoreOptions& options);

}  // namespace creased
