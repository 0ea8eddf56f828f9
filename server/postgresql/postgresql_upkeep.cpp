#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/base/failure.h"
#include "server/postgresql/job_rows.h"
#include "server/postgresql/postgresql_store.h"

namespace creased {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kMostBetweenExpiries{60'000}, kBetweenProbes{10'000}, kBetweenPulses{4'000};
constexpr std::chrono::hours kOldLeftover{1};
constexpr std::int64_t kForgetWorkerMs = 3'600'000;
// Expired jobs are removed so many in a transaction, and as many times in a call.
constexpr std::int64_t kBatch = 100;
constexpr int kMostBatches = 10;

}  // namespace

bool PostgresqlStore::remove(std::string_view id, const Owner& owner) {
  const bool removed = guarded([&] {
    Transaction transaction(sessions_);
    const auto rows = transaction.run(
        "SELECT state FROM jobs WHERE id = $1 AND ($2::text IS NULL OR owner = $2) FOR UPDATE", id, owner);
    if (rows.empty()) return false;
    const std::int64_t version = count_change(transaction);
    transaction.run("DELETE FROM jobs WHERE id = $1", id);
    if (rows[0][0].as<std::string>() == name_of(JobState::kRunning)) tell(transaction, Channel::kHolds);
    commit(transaction, version);
    return true;
  });
  if (!removed) return false;
  discard_removed();
  spdlog::info("job {} removed", id);
  return true;
}

/// Deletes the contents of removed and replaced files, a few in each transaction. Any process finishes what another has
/// left.
void PostgresqlStore::discard_removed() {
  guarded([&] {
    for (;;) {
      Transaction transaction(sessions_);
      transaction.relax();
      const auto gone = transaction
                            .run(
                                "WITH few AS MATERIALIZED"  // its limit could hold for each row of a join
                                " (SELECT blob FROM removed ORDER BY blob LIMIT 20 FOR UPDATE SKIP LOCKED),"
                                " gone AS (DELETE FROM removed WHERE blob = ANY (ARRAY (SELECT blob FROM few))),"
                                " deleted AS (DELETE FROM chunks WHERE blob = ANY (ARRAY (SELECT blob FROM few)))"
                                " SELECT count(*) FROM few")[0][0]
                            .as<std::int64_t>();
      if (gone == 0) return;
      transaction.commit();
    }
  });
}

/// Removes a few jobs, as no other change is counted meanwhile. When there are none, notes when to look again.
std::vector<std::string> PostgresqlStore::remove_some_expired() {
  Transaction transaction(sessions_);
  const auto rows = transaction.run(
      "SELECT seq, id FROM jobs WHERE expires <= (SELECT now_ms()) ORDER BY expires LIMIT $1 FOR UPDATE SKIP LOCKED",
      kBatch);
  if (rows.empty()) {
    const auto next = transaction.run("SELECT min(expires) - now_ms() FROM jobs")[0][0];
    const std::int64_t due = next.is_null() ? kMostBetweenExpiries.count() : next.as<std::int64_t>();
    const std::lock_guard lock(mutex_);
    look_for_expired_at_ = Clock::now() + milliseconds(std::clamp<std::int64_t>(due, 0, kMostBetweenExpiries.count()));
    return {};
  }
  std::vector<std::string> ids, places;
  for (const auto& row : rows) {
    places.push_back(row[0].as<std::string>());
    ids.push_back(row[1].as<std::string>());
  }
  const std::int64_t version = count_change(transaction);
  transaction.run("DELETE FROM jobs WHERE seq = ANY ($1::bigint[])", fmt::format("{{{}}}", fmt::join(places, ",")));
  commit(transaction, version);
  return ids;
}

std::vector<std::string> PostgresqlStore::remove_expired() {
  const auto signals = listener_.signals(Channel::kChanges);
  {
    const std::lock_guard lock(mutex_);
    if (signals == heard_of_ends_ && Clock::now() < look_for_expired_at_) return {};
    heard_of_ends_ = signals;
  }
  std::vector<std::string> ids;
  for (int batch = 0; batch < kMostBatches; ++batch) {
    const auto some = guarded([&] { return remove_some_expired(); });
    if (some.empty()) break;
    ids.insert(ids.end(), some.begin(), some.end());
  }
  for (const std::string& id : ids) spdlog::info("job {} removed: its retention time was over", id);
  discard_removed();
  return ids;
}

void PostgresqlStore::clean_leftovers() { files_.clean_leftovers({}, kOldLeftover); }

void PostgresqlStore::probe_database() {
  with_postgresql_errors([&] {
    Transaction transaction(sessions_);
    transaction.run("UPDATE counting SET since = since");
    transaction.commit();
  });
}

std::uint64_t PostgresqlStore::used_bytes() {
  return guarded([&] {
    Transaction transaction(sessions_);
    return usage_in(transaction, std::nullopt).bytes;
  });
}

std::string PostgresqlStore::not_ready_reason() {
  {
    const std::lock_guard lock(mutex_);
    if (!suspect_ && fault_.empty() && Clock::now() < look_for_faults_at_) return {};
  }
  const std::string fault = DatabaseStore::not_ready_reason();
  const std::lock_guard lock(mutex_);
  fault_ = fault;
  look_for_faults_at_ = Clock::now() + kBetweenProbes;
  return fault;
}

void PostgresqlStore::note_worker(std::string_view name, std::string_view problem) {
  {
    const std::lock_guard lock(mutex_);
    if (problem == last_problem_ && Clock::now() < next_pulse_) return;
    last_problem_ = problem;
    next_pulse_ = Clock::now() + kBetweenPulses;
  }
  guarded([&] {
    Transaction transaction(sessions_);
    transaction.relax();
    transaction.run(
        "INSERT INTO workers VALUES ($1, now_ms(), $2)"
        " ON CONFLICT (name) DO UPDATE SET seen = excluded.seen, problem = excluded.problem",
        name, problem);
    transaction.run("DELETE FROM workers WHERE seen < now_ms() - $1", kForgetWorkerMs);
    transaction.commit();
  });
}

std::vector<WorkerHealth> PostgresqlStore::workers() {
  return guarded([&] {
    std::vector<WorkerHealth> all;
    Transaction transaction(sessions_);
    for (const auto& row : transaction.run("SELECT name, greatest(now_ms() - seen, 0), problem FROM workers")) {
      all.push_back({row[0].as<std::string>(), milliseconds(row[1].as<std::int64_t>()), row[2].as<std::string>()});
    }
    return all;
  });
}

std::string PostgresqlStore::link_secret(const std::string& fresh) {
  return guarded([&] {
    Transaction transaction(sessions_);
    transaction.run("INSERT INTO secrets VALUES ('links', $1) ON CONFLICT (name) DO NOTHING", fresh);
    const auto secret = transaction.run("SELECT value FROM secrets WHERE name = 'links'")[0][0].as<std::string>();
    transaction.commit();
    return secret;
  });
}

}  // namespace creased
