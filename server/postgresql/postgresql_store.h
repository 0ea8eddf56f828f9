#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/base/pace.h"
#include "server/postgresql/blobs.h"
#include "server/postgresql/listener.h"
#include "server/postgresql/session.h"
#include "server/store/database_store.h"

namespace creased {

/// The store that any number of servers and workers share: jobs and their files in a PostgreSQL database. Its times are
/// the database's. The data folder has only what this machine is receiving, making or computing.
///
/// Each change counts itself last, and no other is counted until its commit. So versions become visible in their order,
/// and a transaction locks jobs, then the count, then sums of usage: never in a circle.
class PostgresqlStore final : public DatabaseStore {
 public:
  /// \pre the tables are prepared
  explicit PostgresqlStore(const StoreOptions& options);

  crease::v1::Job submit(const NewJob& job, bool& created) override;
  std::optional<crease::v1::Job> find(std::string_view id, const Owner& owner) override;
  JobPage list(std::string_view state, std::size_t limit, std::string_view cursor, const Owner& owner) override;
  std::optional<crease::v1::Job> cancel(std::string_view id, const Owner& owner) override;
  void cancel_all(const std::string& owner) override;
  std::vector<std::string> busy_owners() override;
  bool remove(std::string_view id, const Owner& owner) override;
  std::size_t queued() override;
  std::chrono::milliseconds longest_wait() override;

  std::uint64_t last_version() override;
  std::vector<JobChange> changes_since(std::uint64_t since) override;
  std::uint64_t version_of(std::string_view id) override;
  std::vector<std::string> missing(const std::vector<std::string>& ids) override;

  std::optional<Claim> claim(std::string_view worker, std::chrono::milliseconds lease) override;
  Hold check(const Claim& claim) override;
  Hold renew(const Claim& claim, std::chrono::milliseconds lease) override;
  void publish_progress(const Claim& claim, const crease::v1::Progress& progress) override;
  void note_checkpoint(const Claim& claim) override;
  void note_snapshot(const Claim& claim) override;
  bool succeed(const Claim& claim, const crease::v1::ResultFacts& result,
               const std::vector<crease::v1::Warning>& warnings, const std::vector<FileRecord>& files) override;
  bool put_back(const Claim& claim) override;
  std::vector<std::string> busy_workers() override;
  void lose_all(std::string_view worker, const Loss& loss) override;
  void note_worker(std::string_view name, std::string_view problem) override;
  std::vector<WorkerHealth> workers() override;

  std::shared_ptr<const OpenFile> open(std::string_view id, std::string_view name) override;
  std::filesystem::path working_path(const Claim& claim, std::string_view name) const override;
  std::optional<FileRecord> file_record(std::string_view id, std::string_view name) override;
  bool keep_file(std::string_view id, const FileRecord& file, const std::filesystem::path& made) override;

  std::vector<std::string> remove_expired() override;
  void clean_leftovers() override;
  std::string not_ready_reason() override;
  bool is_shared() const override { return true; }
  std::string link_secret(const std::string& fresh) override;

 private:
  using Clock = std::chrono::steady_clock;

  // Storing checkpoints takes at most a tenth of a worker's time, storing snapshots a twentieth.
  static constexpr int kPartsOfCheckpoints = 10, kPartsOfSnapshots = 20;

  /// A running job, locked in a transaction.
  struct RunningJob {
    std::string id;
    Life life;
    std::string progress;
  };
  /// A file that the worker of a job replaces again and again.
  struct PassingFile {
    Pace pace;
    bool newer_here = false;
  };
  /// The last answer of check().
  struct Checked {
    Claim claim;
    Hold hold = Hold::kLost;
    std::uint64_t signals = 0;
    Clock::time_point until;
  };

  bool take(const Claim& claim, const Step& step) override;
  void probe_database() override;
  std::uint64_t used_bytes() override;

  template <class Work>
  auto guarded(const Work& work) -> decltype(work()) {
    return noting_failure([&] { return with_postgresql_errors(work); });
  }

  /// Takes the number of the next change, which is told with its commit.
  static std::int64_t count_change(Transaction& transaction);
  static void tell(Transaction& transaction, Channel channel);
  void commit(Transaction& transaction, std::int64_t version);

  std::optional<crease::v1::Job> job_of_key(Transaction& transaction, const NewJob& request);
  std::string insert(Transaction& transaction, const NewJob& request, std::uint64_t bytes, std::int64_t version);

  static std::optional<RunningJob> held(Transaction& transaction, const Claim& claim);
  std::int64_t take(Transaction& transaction, const RunningJob& job, const Transition& step);
  std::size_t lose_jobs(Transaction& transaction, const pqxx::result& rows, const Loss& loss, std::int64_t& version);
  /// What there is to claim.
  struct Work {
    bool queued = false;   ///< a job that need not wait
    bool expired = false;  ///< a lease that is over
  };
  bool may_have_work();
  Work look_for_work(Transaction& transaction);
  void lose_expired(Transaction& transaction, std::int64_t& version);
  std::optional<Claim> claim_next(Transaction& transaction, std::string_view worker, std::chrono::milliseconds lease,
                                  std::int64_t& version);
  void store_passing(const Claim& claim, std::string_view name, PassingFile& file);
  void put_file(Transaction& transaction, std::string_view id, const FileRecord& file, const BlobRef& blob);
  void tidy_after(const Claim& claim);
  void remember(const Claim& claim, Hold hold, std::uint64_t signals);

  std::vector<std::string> remove_some_expired();
  void discard_removed();

  const std::string url_;
  SessionPool sessions_;
  Listener listener_;
  BlobCache blobs_;
  std::atomic<bool> has_removed_{false};  // files that are to be discarded

  std::mutex mutex_;  // guards the rest
  std::uint64_t heard_of_work_ = 0;
  Clock::time_point look_for_work_at_;
  Checked checked_;
  PassingFile checkpoint_{Pace(kPartsOfCheckpoints)}, snapshot_{Pace(kPartsOfSnapshots)};
  std::string last_problem_;
  Clock::time_point next_pulse_;
  std::uint64_t heard_of_ends_ = 0;
  Clock::time_point look_for_expired_at_;
  std::string fault_;
  Clock::time_point look_for_faults_at_;
};

/// Opens a store, whose tables it creates or migrates. Waits for the database as await_tables() does. \throw Error
/// store_unavailable
std::unique_ptr<Store> open_postgresql_store(const StoreOptions& options);

}  // namespace creased
