#include "server/worker/lease_keeper.h"

#include <spdlog/spdlog.h>

#include <system_error>

#include "core/error.h"

namespace creased {
namespace code = crease::code;

LeaseKeeper::LeaseKeeper(Store& store, const Claim& claim, std::chrono::milliseconds lease, std::atomic<bool>& cancel)
    : store_(store), claim_(claim), lease_(lease), cancel_(cancel) {
  try {
    thread_ = std::jthread([this](const std::stop_token& ended) { keep(ended); });
  } catch (const std::system_error& error) {
    throw crease::Error(code::kProcessUnavailable, "cannot start a thread: " + error.code().message());
  }
}

void LeaseKeeper::keep(const std::stop_token& ended) {
  constexpr int kRenewalsPerLease = 3;
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, ended, lease_ / kRenewalsPerLease, [&ended] { return ended.stop_requested(); })) {
    try {
      if (store_.renew(claim_, lease_) != Store::Hold::kHeld) cancel_ = true;
    } catch (const crease::Error& error) {
      spdlog::warn("job {}: cannot renew the lease: {}", claim_.job_id, error.detail());
    }
  }
}

}  // namespace creased
