#include "server/worker/lease_keeper.h"

#include <spdlog/spdlog.h>

#include "core/error.h"

namespace creased {

LeaseKeeper::LeaseKeeper(Store& store, const Claim& claim, std::chrono::milliseconds lease, std::atomic<bool>& cancel)
    : store_(store), claim_(claim), lease_(lease), cancel_(cancel), thread_([this](const std::stop_token& ended) {
        keep(ended);
      }) {}

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
