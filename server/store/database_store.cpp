#include "server/store/database_store.h"

#include <fmt/format.h>

#include <utility>

#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;

bool DatabaseStore::fail(const Claim& claim, const crease::v1::Problem& problem) {
  return take(claim, [&](const Life& life) { return Transition{ended(life, JobState::kFailed), {}, problem}; });
}

bool DatabaseStore::finish_cancelled(const Claim& claim) {
  return take(claim, [](const Life& life) { return Transition{ended(life, JobState::kCancelled)}; });
}

bool DatabaseStore::put_back(const Claim& claim) {
  return take(claim, [](const Life& life) { return creased::put_back(life); });
}

bool DatabaseStore::defer(const Claim& claim, const crease::Error& reason) {
  suspect_ = true;
  return take(claim, [&](const Life& life) { return deferred(life, reason); });
}

bool DatabaseStore::lose(const Claim& claim, const Loss& loss) {
  return take(claim, [&](const Life& life) { return lost(life, loss, options_.max_attempts); });
}

std::filesystem::path DatabaseStore::temporary_path() { return files_.temporary_path(); }

void DatabaseStore::note_failure() {
  suspect_ = true;
  leases_.distrust();
}

void DatabaseStore::refuse_claims_of_a_sick_store() {
  if (!suspect_) return;
  if (const std::string reason = not_ready_reason(); !reason.empty()) {
    throw crease::Error(code::kStoreUnavailable, "no job is claimed: " + reason);
  }
}

/// Writes and syncs a file of this machine and a row. Returns why that failed; empty when both are sound.
std::string DatabaseStore::write_fault() {
  try {
    files_.probe();
    probe_database();
    const auto room = files_.room();
    if (room.free < room.reserve()) return fmt::format("only {} of disk space are left", megabytes(room.free));
    suspect_ = false;
    return {};
  } catch (const crease::Error& error) {
    note_failure();
    return error.detail();
  }
}

std::string DatabaseStore::not_ready_reason() {
  if (std::string fault = write_fault(); !fault.empty()) return fault;
  if (options_.quota_bytes == 0 || used_bytes() < options_.quota_bytes) return {};
  return fmt::format("the quota of {} is used up", megabytes(options_.quota_bytes));
}

JobPage page_of(std::vector<ListedJob> found, std::size_t limit) {
  JobPage page;
  if (found.size() > limit) {
    found.resize(limit);
    page.next_cursor = cursor_after(found.back().seq);
  }
  for (ListedJob& listed : found) page.jobs.push_back(std::move(listed.job));
  return page;
}

}  // namespace creased
