#include "server/access/gatekeeper.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "server/base/log.h"

namespace creased {
namespace {

constexpr std::string_view kScheme = "bearer ";

bool is_bearer(std::string_view authorization) {
  return authorization.size() > kScheme.size() &&
         crease::equals_ignoring_case(authorization.substr(0, kScheme.size()), kScheme);
}

std::string bucket_of(const Caller& caller, const Source& source) {
  return caller.key == nullptr ? "address " + source.address.subscriber() : "key " + caller.key->id;
}

/// Rounds up to whole seconds, for Retry-After.
std::chrono::seconds whole_seconds(std::chrono::duration<double> wait) {
  return std::chrono::ceil<std::chrono::seconds>(wait);
}

}  // namespace

Gatekeeper::Gatekeeper(Options options) : options_(std::move(options)), keys_(std::make_shared<const KeyRing>()) {
  if (keyed()) reload();
}

void Gatekeeper::reload() {
  auto keys = std::make_shared<const KeyRing>(read_keys(options_.keys, options_.key_defaults));
  if (readable_by_others(options_.keys)) {
    spdlog::warn("{} can be read by other users; run chmod 600 on it", options_.keys.string());
  }
  log_event(spdlog::level::info, "keys loaded", {{"file", options_.keys.string()}, {"keys", keys->size()}});
  const std::lock_guard lock(mutex_);
  keys_ = std::move(keys);
}

bool Gatekeeper::knows(const std::string& owner) const {
  if (!keyed()) return true;
  const std::lock_guard lock(mutex_);
  return keys_->has(owner);
}

Caller Gatekeeper::identify(std::string_view authorization) const {
  Caller caller{nullptr, options_.open};
  if (!keyed() || !is_bearer(authorization)) return caller;
  std::shared_ptr<const KeyRing> keys;
  {
    const std::lock_guard lock(mutex_);
    keys = keys_;
  }
  caller.key = keys->find(authorization.substr(kScheme.size()));
  if (caller.key != nullptr) caller.limits = caller.key->limits;
  return caller;
}

std::chrono::seconds Gatekeeper::count_call(const Caller& caller, const Source& source) {
  if (caller.key == nullptr && source.local) return {};
  const Rate& rate = caller.limits.requests;
  auto wait = calls_.take(bucket_of(caller, source), rate);
  const std::string site = caller.key == nullptr ? source.address.site() : std::string();
  if (wait.count() <= 0 && !site.empty()) {
    constexpr double kSubscribersOfSite = 8;
    wait = sites_.take(site, {rate.per_second * kSubscribersOfSite, rate.burst * kSubscribersOfSite});
  }
  return whole_seconds(wait);
}

std::chrono::seconds Gatekeeper::count_job(const Caller& caller, const Source& source) {
  constexpr double kSecondsPerMinute = 60;
  const double rate = caller.limits.jobs_per_minute;
  return whole_seconds(jobs_.take(bucket_of(caller, source), {rate / kSecondsPerMinute, std::max(1.0, rate)}));
}

}  // namespace creased
