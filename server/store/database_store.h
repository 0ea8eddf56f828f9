#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "server/jobs/life.h"
#include "server/store/job_facts.h"
#include "server/store/job_files.h"
#include "server/store/lease_trust.h"
#include "server/store/store.h"

namespace creased {

/// What stores do alike, whatever database keeps their jobs: they take the steps of jobs/life.h, and notice when the
/// database or the disk of this machine has failed.
class DatabaseStore : public Store {
 public:
  bool fail(const Claim& claim, const crease::v1::Problem& problem) final;
  bool finish_cancelled(const Claim& claim) final;
  bool put_back(const Claim& claim) override;
  bool defer(const Claim& claim, const crease::Error& reason) final;
  bool lose(const Claim& claim, const Loss& loss) final;

  std::filesystem::path temporary_path() final;
  std::string not_ready_reason() override;

 protected:
  using Step = std::function<Transition(const Life&)>;

  explicit DatabaseStore(const StoreOptions& options) : options_(options), files_(options.data_dir) {}

  /// Takes a step of a claimed job. Returns false when the job no longer belongs to the worker.
  virtual bool take(const Claim& claim, const Step& step) = 0;
  /// Writes to the database, durably. \throw Error of the store
  virtual void probe_database() = 0;
  /// The bytes that all jobs together count for.
  virtual std::uint64_t used_bytes() = 0;

  /// Runs `work`, and remembers when the store has failed.
  template <class Work>
  auto noting_failure(const Work& work) -> decltype(work()) {
    try {
      return work();
    } catch (const crease::Error& error) {
      if (is_fault_of_store(error.code())) note_failure();
      throw;
    }
  }
  void note_failure();
  /// \throw Error store_unavailable when a call has failed and the store is still not ready
  void refuse_claims_of_a_sick_store();

  const StoreOptions options_;
  JobFiles files_;
  std::atomic<bool> suspect_{false};  ///< a call has failed since the last check
  LeaseTrust leases_;

 private:
  std::string write_fault();
};

/// A job of a list, and its place in the order of submission.
struct ListedJob {
  std::int64_t seq = 0;
  crease::v1::Job job;
};

/// The first `limit` of the jobs that were found, at least one, with a cursor where there are more.
JobPage page_of(std::vector<ListedJob> found, std::size_t limit);

}  // namespace creased
