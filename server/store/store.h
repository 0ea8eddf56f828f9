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
#include "server/store/failure.h"

namespace creased {

/// What one owner may have in the store; 0: no bound of its own.
struct OwnerLimits {
  std::size_t max_queued = 0;
  std::uint64_t max_bytes = 0;
};

/// A job as submitted: the upload and its weights lie in files that the store takes over.
struct NewJob {
  std::string owner;  ///< the key that it came with; empty: the service is open
  OwnerLimits owner_limits;
  std::string fingerprint;        ///< becomes the id, unless a job has it: then a suffix is added
  std::filesystem::path upload;   ///< at a temporary_path(); gone from there after submit(), whatever comes of it
  std::filesystem::path weights;  ///< likewise; empty: none came beside the mesh
  crease::v1::InputFacts input;
  crease::v1::Parameters parameters;  ///< resolved; how long results are kept is one of them
  std::vector<crease::v1::Warning> warnings;
  std::string idempotency_key;  ///< empty: none
  std::string request_digest;   ///< what an idempotent retry must repeat
};

/// Why an attempt of a job did not come to an end.
struct Loss {
  std::string what;                           ///< "was killed by signal 11 (SIGSEGV)"
  std::string_view code = code::kWorkerLost;  ///< of the error after the last attempt
  bool with_server = false;  ///< the whole service went: hardly the job's doing, so it counts a quarter
  bool by_limit = false;  ///< a limit of memory or time, which the next attempt meets again however far this one came
};

/// A worker's right to a job, until the lease runs out.
struct Claim {
  std::string job_id;
  std::string owner;
  std::uint32_t attempt = 0;
};

/// Whose jobs a call is about; nullopt: everybody's.
using Owner = std::optional<std::string>;

struct JobPage {
  std::vector<crease::v1::Job> jobs;  ///< newest first
  std::string next_cursor;            ///< empty: no more
};

struct JobChange {
  std::string job_id;
  std::uint64_t version = 0;
};

/// Jobs and their files: the only channel between the HTTP side and the workers. Safe to use from many threads and
/// many processes. Links of a Job are left to the HTTP side.
class Store {
 public:
  virtual ~Store() = default;

  // HTTP side.
  // Where an `owner` is given, jobs of others are as if they did not exist.
  /// Durable when it returns. With an idempotency key that the owner has used, the job of that key and `created` =
  /// false.
  /// \throw Error idempotency_conflict when the key came with another request, queue_full and key_queue_full over the
  /// bounds of queued jobs, quota_exceeded over those of bytes, storage_full when the disk has no room for the job
  virtual crease::v1::Job submit(const NewJob& job, bool& created) = 0;
  virtual std::optional<crease::v1::Job> find(std::string_view id, const Owner& owner = std::nullopt) = 0;
  /// \throw Error parameter_invalid for a cursor that this store did not give
  virtual JobPage list(std::string_view state, std::size_t limit, std::string_view cursor,
                       const Owner& owner = std::nullopt) = 0;
  /// A queued job is cancelled at once, a running one within a sweep. nullopt: no such job. Ended jobs stay as they
  /// are.
  virtual std::optional<crease::v1::Job> cancel(std::string_view id, const Owner& owner = std::nullopt) = 0;
  /// Removes the job and every byte of it; a running one is abandoned by its worker. False: no such job.
  virtual bool remove(std::string_view id, const Owner& owner = std::nullopt) = 0;
  /// Removes ended jobs whose time is over, and what interrupted removals have left. Returns the ids of those jobs.
  virtual std::vector<std::string> remove_expired() = 0;
  /// Counts `bytes` more that are kept for a job. False: there is no room for them, or no such job.
  virtual bool charge(std::string_view id, std::uint64_t bytes) = 0;
  /// Grows with every change of any job. Jobs changed after `since`, oldest change first; removed jobs are not listed.
  virtual std::uint64_t last_version() = 0;
  virtual std::vector<JobChange> changes_since(std::uint64_t since) = 0;
  /// The version at which a job last changed; 0: no such job.
  virtual std::uint64_t version_of(std::string_view id) = 0;
  /// Throws or returns why the store cannot take jobs (disk, permissions); empty: ready.
  virtual std::string not_ready_reason() = 0;
  virtual std::size_t queued() = 0;

  // Worker side.
  /// The oldest queued job, or one whose lease ran out.
  virtual std::optional<Claim> claim(std::string_view owner, std::chrono::milliseconds lease) = 0;
  enum class Hold { kHeld, kCancelRequested, kLost };
  /// Whether the job is still this worker's, and whether it is to stop. Cheap.
  virtual Hold check(const Claim& claim) = 0;
  virtual Hold renew(const Claim& claim, std::chrono::milliseconds lease) = 0;
  virtual void publish_progress(const Claim& claim, const crease::v1::Progress& progress) = 0;
  /// The job has come further than its attempts before: those do not count against it any more.
  virtual void note_checkpoint(const Claim& claim) = 0;
  // The ends of a claim. False: the job was no longer this worker's, and nothing has changed.
  /// A job that is complete succeeds even if it was to be cancelled. `warnings` are added to those of submission.
  virtual bool succeed(const Claim& claim, const crease::v1::ResultFacts& result,
                       const std::vector<crease::v1::Warning>& warnings) = 0;
  virtual bool fail(const Claim& claim, const crease::v1::Problem& problem) = 0;
  virtual bool finish_cancelled(const Claim& claim) = 0;
  /// Back to the queue; the attempt does not count. A job that was to be cancelled is cancelled instead.
  virtual bool put_back(const Claim& claim) = 0;
  /// The attempt is lost: back to the queue, or failed after `max_attempts` in a row that came to nothing, with what
  /// became of each. A job that was to be cancelled is cancelled.
  virtual bool lose(const Claim& claim, const Loss& loss) = 0;
  /// The names of workers that hold a claim.
  virtual std::vector<std::string> busy_workers() = 0;
  /// The worker of that name is no more: what it had claimed is lost.
  virtual void lose_all(std::string_view worker, const Loss& loss) = 0;

  // Files. Written whole under another name, then renamed; a reader that has one open keeps it.
  // \throw Error job_not_found for what cannot be the id of a job
  virtual std::filesystem::path upload_path(std::string_view id) const = 0;
  virtual std::filesystem::path file_path(std::string_view id, std::string_view name) const = 0;
  /// A fresh name beside the jobs' files, for uploads on their way in.
  virtual std::filesystem::path temporary_path() = 0;
};

/// Files of a job beside its upload.
namespace file {
inline constexpr std::string_view kWeights = "weights.json";   ///< as it was sent, only where weights were
inline constexpr std::string_view kResult = "result.pb";       ///< crease.v1.LabelledMesh
inline constexpr std::string_view kReport = "report.pb";       ///< crease.v1.Report
inline constexpr std::string_view kCheckpoint = "checkpoint";  ///< where a run that was cut short goes on
inline constexpr std::string_view kSnapshot = "snapshot.pb";   ///< crease.v1.LabelledMesh of a running job
}  // namespace file

struct StoreOptions {
  std::string url = "sqlite";
  std::filesystem::path data_dir;
  std::size_t max_queued = 10'000;
  std::uint32_t max_attempts = 3;
  std::uint64_t quota_bytes = 0;  ///< of all jobs together; 0: until the disk is full
};

/// Opens or creates a store. \throw Error store_unavailable
std::unique_ptr<Store> open_store(const StoreOptions& options);

}  // namespace creased
