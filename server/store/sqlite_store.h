#pragma once

#include "server/store/job_files.h"
#include "server/store/sqlite_connection.h"
#include "server/store/store.h"

namespace creased {

/// The embedded store: an SQLite database (creased.db) in WAL mode and a folder of files for each job.
class SqliteStore final : public Store {
 public:
  explicit SqliteStore(const StoreOptions& options);

  crease::v1::Job submit(const NewJob& job, bool& created) override;
  std::optional<crease::v1::Job> find(std::string_view id, const Owner& owner) override;
  JobPage list(std::string_view state, std::size_t limit, std::string_view cursor, const Owner& owner) override;
  std::optional<crease::v1::Job> cancel(std::string_view id, const Owner& owner) override;
  bool remove(std::string_view id, const Owner& owner) override;
  std::vector<std::string> remove_expired() override;
  bool charge(std::string_view id, std::uint64_t bytes) override;
  std::uint64_t last_version() override;
  std::vector<JobChange> changes_since(std::uint64_t since) override;
  std::uint64_t version_of(std::string_view id) override;
  std::string not_ready_reason() override;
  std::size_t queued() override;

  std::optional<Claim> claim(std::string_view owner, std::chrono::milliseconds lease) override;
  Hold check(const Claim& claim) override;
  Hold renew(const Claim& claim, std::chrono::milliseconds lease) override;
  void publish_progress(const Claim& claim, const crease::v1::Progress& progress) override;
  void note_checkpoint(const Claim& claim) override;
  bool succeed(const Claim& claim, const crease::v1::ResultFacts& result,
               const std::vector<crease::v1::Warning>& warnings) override;
  bool fail(const Claim& claim, const crease::v1::Problem& problem) override;
  bool finish_cancelled(const Claim& claim) override;
  bool put_back(const Claim& claim) override;
  bool lose(const Claim& claim, const Loss& loss) override;
  std::vector<std::string> busy_workers() override;
  void lose_all(std::string_view worker, const Loss& loss) override;

  std::filesystem::path upload_path(std::string_view id) const override;
  std::filesystem::path file_path(std::string_view id, std::string_view name) const override;
  std::filesystem::path temporary_path() override;

 private:
  std::string reserve_id(const std::string& fingerprint);
  std::optional<crease::v1::Job> insert(const NewJob& job, const std::string& id);
  void check_room(Connection& connection, const NewJob& job, std::uint64_t bytes) const;
  void discard_removed();

  JobFiles files_;
  std::filesystem::path database_;
  std::size_t max_queued_;
  std::uint32_t max_attempts_;
  std::uint64_t quota_bytes_;
  ReaderPool readers_;
  Writer writer_, durable_writer_;
};

}  // namespace creased
