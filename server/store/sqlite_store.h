#pragma once

#include <atomic>

#include "crease/v1/stored.pb.h"
#include "server/store/database_store.h"
#include "server/store/job_row.h"
#include "server/store/sqlite_connection.h"

namespace creased {

/// The embedded store: an SQLite database (creased.db) in WAL mode and a folder of files for each job.
class SqliteStore final : public DatabaseStore {
 public:
  explicit SqliteStore(const StoreOptions& options);

  crease::v1::Job submit(const NewJob& job, bool& created) override;
  std::optional<crease::v1::Job> find(std::string_view id, const Owner& owner) override;
  JobPage list(std::string_view state, std::size_t limit, std::string_view cursor, const Owner& owner) override;
  std::optional<crease::v1::Job> cancel(std::string_view id, const Owner& owner) override;
  void cancel_all(const std::string& owner) override;
  std::vector<std::string> busy_owners() override;
  bool remove(std::string_view id, const Owner& owner) override;
  std::vector<std::string> remove_expired() override;
  void clean_leftovers() override;
  std::uint64_t last_version() override;
  std::vector<JobChange> changes_since(std::uint64_t since) override;
  std::uint64_t version_of(std::string_view id) override;
  std::vector<std::string> missing(const std::vector<std::string>& ids) override;
  std::size_t queued() override;
  std::chrono::milliseconds longest_wait() override;
  bool is_shared() const override { return false; }
  std::string link_secret(const std::string&) override { return {}; }

  std::optional<Claim> claim(std::string_view worker, std::chrono::milliseconds lease) override;
  Hold check(const Claim& claim) override;
  Hold renew(const Claim& claim, std::chrono::milliseconds lease) override;
  void publish_progress(const Claim& claim, const crease::v1::Progress& progress) override;
  void note_checkpoint(const Claim& claim) override;
  void note_snapshot(const Claim&) override {}
  bool succeed(const Claim& claim, const crease::v1::ResultFacts& result,
               const std::vector<crease::v1::Warning>& warnings, const std::vector<FileRecord>& files) override;
  std::vector<std::string> busy_workers() override;
  void lose_all(std::string_view worker, const Loss& loss) override;
  void note_worker(std::string_view name, std::string_view problem) override;
  std::vector<WorkerHealth> workers() override;

  std::shared_ptr<const OpenFile> open(std::string_view id, std::string_view name) override;
  std::filesystem::path working_path(const Claim& claim, std::string_view name) const override;
  std::optional<FileRecord> file_record(std::string_view id, std::string_view name) override;
  bool keep_file(std::string_view id, const FileRecord& file, const std::filesystem::path& made) override;

 private:
  bool take(const Claim& claim, const Step& step) override;
  void probe_database() override;
  std::uint64_t used_bytes() override;

  /// Runs `work`, turns errors of SQLite into errors of the store, and remembers when the store has failed.
  template <class Work>
  auto guarded(const Work& work) -> decltype(work()) {
    return noting_failure([&] { return with_store_errors(work); });
  }

  std::string reserve_id(const std::string& fingerprint);
  crease::v1::Job insert(const NewJob& job, const std::string& id, bool& created);
  void write_accepted(const NewJob& job, const std::string& id) const;
  void check_room(Connection& connection, const NewJob& job, std::uint64_t bytes) const;
  bool delete_row(std::string_view id, const Owner& owner);
  void discard_removed();
  bool is_being_removed(const std::string& id);
  void adopt_folders();
  void adopt(const std::string& id, const crease::v1::StoredJob& accepted);
  void write_end(const std::string& id, const std::vector<FileRecord>& files) const;
  /// The files that the job ended with; empty unless all of them are as they were then.
  std::vector<FileRecord> whole_files(const std::string& id) const;
  std::int64_t clock_step(Connection& connection);
  void move_expiry();

  void take(Connection& connection, const std::string& id, const std::string& progress, const Transition& step);
  std::size_t lose_where(Connection& connection, std::string_view condition, std::string_view text, std::int64_t number,
                         const Loss& loss);
  static std::optional<Claim> claim_next(Connection& connection, std::string_view worker, std::int64_t now,
                                         std::chrono::milliseconds lease);

  std::filesystem::path database_;
  std::atomic<std::int64_t> last_expiry_ms_{0};
  ReaderPool readers_;
  Writer writer_, durable_writer_;
};

}  // namespace creased
